// Where the data set comes from, and what was proved of it.

import { facts, proof, summary } from "report/data.js";
import { byId, count, decimal, el, plural, table } from "report/dom.js";

const day = (iso) => iso.replace("T", " ").replace("+00:00", " UTC");

function duration(seconds) {
  if (seconds < 90) return `${decimal(seconds, 1)} s`;
  if (seconds < 5400) return `${decimal(seconds / 60, 1)} min`;
  return `${decimal(seconds / 3600, 1)} h`;
}

function timingRows() {
  const t = facts.timing;
  if (!t) return [];
  const rate = t.seconds > 0 ? `${duration(t.seconds)} from the first finished shot on, ${decimal(t.frames / t.seconds, 1)} frames/s` : "one shot only";
  return [
    ["Rendered", t.first === t.last ? day(t.first) : `${day(t.first)} to ${day(t.last)}`],
    ["Time taken", `${rate}${t.runs > 1 ? `, with ${plural(t.runs - 1, "break")}` : ""} (from the files' times)`],
  ];
}

function origin() {
  const left = Object.entries(facts.leftOut);
  const warnings = Object.entries(facts.warnings);
  const list = (entries) => el("ul", { class: "findings" }, ...entries.slice(0, 40).map(([key, why]) => el("li", {}, `${key}: ${[why].flat().join("; ")}`)));
  return el("figure", {}, el("h3", {}, "Made of"),
    table([
      ["Folder", facts.folder],
      ["Plan", `${count(summary.planned)} frames: ${plural(facts.plannedModels, "model")}, ${plural(facts.poses, "pose")}`],
      ["Recipe's digest", facts.digest.slice(0, 16)],
      ["Channels", facts.channels.join(", ")],
      ["Exports", facts.exports.join(", ") || "none"],
      ["Made by", `viewsphere ${facts.madeBy}`],
      ...timingRows(),
      ["This page", `${day(facts.reported)}, viewsphere ${facts.reportBy}`],
    ]),
    left.length ? el("details", {}, el("summary", {}, `${count(left.length)} left out`), list(left)) : null,
    warnings.length ? el("details", {}, el("summary", {}, `Warnings of ${plural(warnings.length, "model")}`), list(warnings)) : null);
}

function proofs() {
  const figure = el("figure", {}, el("h3", {}, "Proofs (viewsphere check)"));
  if (!proof) {
    figure.append(el("p", { class: "lead" }, "Not run for this page."));
    return figure;
  }
  const failed = (name) => proof.findings.filter((finding) => finding.startsWith(`${name}:`)).length;
  const rows = Object.entries(proof.checked).map(([name, n]) => [
    name,
    failed(name) ? el("span", { class: "bad" }, `✗ ${plural(failed(name), "finding")}`) : el("span", { class: "good" }, "✓ holds"),
    `${count(n)} checked`,
  ]);
  rows.push(...Object.entries(proof.not_run).map(([name, reason]) => [name, el("span", { class: "note" }, "not run"), reason]));
  figure.append(table(rows));
  if (proof.findings.length) {
    figure.append(el("ul", { class: "findings bad" }, ...proof.findings.slice(0, 40).map((finding) => el("li", {}, finding))));
    if (proof.findings.length > 40) figure.append(el("p", { class: "note" }, `and ${count(proof.findings.length - 40)} more: viewsphere check lists them`));
  }
  if (proof.notes.length) figure.append(el("ul", { class: "findings" }, ...proof.notes.map((note) => el("li", {}, note))));
  return figure;
}

function recipe() {
  const lines = facts.recipe.split("\n").flatMap((line) => {
    const [, indent, key, rest] = line.match(/^(\s*(?:- )?)([\w-]+:)(.*)$/) ?? [null, "", null, line];
    return [indent, key ? el("span", { class: "key" }, key) : "", `${rest}\n`];
  });
  return el("pre", { tabindex: 0 }, ...lines);
}

export function verdict() {
  if (!proof) return el("a", { class: "badge none", href: "#provenance" }, "labels not checked for this page");
  const kind = proof.ok ? "good" : "bad";
  return el("a", { class: `badge ${kind}`, href: "#provenance" }, `${proof.ok ? "✓" : "✗"} ${proof.verdict}`);
}

export function showProvenance() {
  byId("provenance-pair").append(origin(), proofs());
  byId("recipe").append(recipe());
}
