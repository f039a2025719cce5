// Writes vendor.min.js (one classic script, tree-shaken) and LICENSES.txt (of every package that is in it).
import { readFile, readdir, writeFile } from "node:fs/promises";
import { build } from "esbuild";

const { metafile } = await build({
  entryPoints: ["entry.js"], outfile: "vendor.min.js", bundle: true, minify: true, metafile: true,
  format: "iife", globalName: "viewsphereVendor", target: "es2022", legalComments: "none", charset: "ascii",
});

const [output] = Object.values(metafile.outputs);
const used = Object.entries(output.inputs).filter(([, { bytesInOutput }]) => bytesInOutput > 0);
const folders = new Set(used.map(([file]) => file.match(/^(node_modules\/(?:@[^/]+\/)?[^/]+)\//)?.[1]).filter(Boolean));

const texts = [];
for (const folder of [...folders].sort()) {
  const { name, version, license } = JSON.parse(await readFile(`${folder}/package.json`, "utf8"));
  const file = (await readdir(folder)).find((entry) => /^licen[cs]e/i.test(entry));
  texts.push(`${name} ${version} (${license})\n\n${(await readFile(`${folder}/${file}`, "utf8")).trim()}\n`);
}
await writeFile("LICENSES.txt", texts.join(`\n${"-".repeat(80)}\n\n`));
