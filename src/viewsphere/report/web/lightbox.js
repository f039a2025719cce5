// One picture enlarged, with its numbers; arrow keys turn to its neighbours.

import { categoryName, categoryToken, data, keys, poseName, subject } from "report/data.js";
import { byId, count, decimal, degrees, el, percent, table } from "report/dom.js";
import { layerButtons, picture } from "report/gallery.js";
import { subscribe } from "report/state.js";
import { surfaceLayer } from "report/overlay.js";

let frames = [];
let at = 0;
let current = null;
let parts = null;

/** The dialog's parts, made once. */
function prepare() {
  if (parts) return parts;
  const dialog = byId("lightbox");
  const title = el("h2", { id: "lightbox-title" });
  const button = (label, text, action) => el("button", { type: "button", "aria-label": label, onclick: action }, text);
  const holder = el("div", { class: "frame" });
  const aside = el("aside", { "aria-label": "Numbers of this frame", tabindex: 0 });
  dialog.append(el("div", { class: "viewer" },
    el("header", {}, title, button("Previous picture", "←", () => turn(-1)), button("Next picture", "→", () => turn(1)),
      button("Close", "✕", () => dialog.close())),
    el("div", { class: "layers", role: "toolbar", "aria-label": "What is drawn over the picture" }, ...layerButtons()),
    el("div", { class: "body" }, holder, aside)));
  dialog.addEventListener("keydown", (event) => {
    if (event.key === "ArrowLeft") turn(-1);
    else if (event.key === "ArrowRight") turn(1);
  });
  dialog.addEventListener("close", () => {
    frames.show?.(at);
    document.querySelector(`.card[data-frame="${current.frame.index}"]`)?.focus();
  });
  subscribe("layers", refresh);
  new ResizeObserver(refresh).observe(holder);
  document.addEventListener("themechange", refresh);
  return (parts = { dialog, title, holder, aside });
}

/** Enlarge a frame. `among` are the frames that the arrows turn to: a list, or what has `length`, `indexOf` and `at`, which may
 *  give a promise of a frame, and perhaps `show`, which brings one into sight among its neighbours.
 */
export function openLightbox(frame, among) {
  frames = among.indexOf(frame) >= 0 ? among : [frame];
  at = frames.indexOf(frame);
  const { dialog } = prepare();
  dialog.showModal();
  show();
}

function turn(change) {
  at = (at + change + frames.length) % frames.length;
  show();
}

async function show() {
  const asked = frames.at(at);
  const turned = at;
  const frame = asked instanceof Promise ? await asked : asked;
  if (turned !== at || !frame) return; // turned on meanwhile, or not to be had
  const { title, holder, aside } = parts;
  title.textContent = `Frame ${count(frame.index)}: ${subject(frame)}`;
  current = { frame, ...picture(frame, true), legend: el("div", { class: "ramp" }) };
  holder.replaceChildren(current.holder, current.legend);
  aside.replaceChildren(...numbers(frame));
  aside.scrollTop = 0;
  refresh();
}

async function refresh() {
  if (!current || !parts.dialog.open) return;
  const { frame, legend: place } = current;
  current.redraw();
  const layer = surfaceLayer(frame)?.name;
  if (data.live && layer) frame.layers[`${layer}Range`] ??= await data.live.range(frame, layer);
  place.replaceChildren(...legend(frame));
}

/** What the colours of a layer mean, as swatches. */
const key = (layer) => keys[layer].map(([words, color]) =>
  el("span", {}, color ? el("b", { class: "swatch", style: `background:rgb(${color})` }) : null, words.replace(/^[a-z_]+: /, "")));

export function legend(frame) {
  const layer = surfaceLayer(frame)?.name;
  if (layer === "depth" && frame.layers.depthRange) {
    const [near, far] = frame.layers.depthRange;
    const middle = Math.sqrt(Math.max(near, 0.01) * far);  // equal factors of distance are equal steps of colour
    return [`${decimal(near)} m`, el("i", { class: "viridis" }), `${decimal(far)} m and farther, the middle is ${decimal(middle)} m`];
  }
  if (layer === "disparity" && frame.layers.disparityRange) {
    const [near, far] = frame.layers.disparityRange;
    return [`${decimal(near)} px`, el("i", { class: "viridis" }), `${decimal(far)} px and less`];
  }
  if (layer === "flow" && frame.layers.flowRange) return [...key("flow"), `full colour: ${decimal(frame.layers.flowRange[1])} px to the next instant`];
  if (frame.scan) return ["on top the range image, near is light;", ...key("lidar")];
  if (keys[layer]) return key(layer);
  return {
    normals: ["red: right, green: up, blue: towards the camera"],
    coordinates: ["in the object's box: red to its left, green to its back, blue up"],
    parts: ["a colour for each named part"],
    materials: ["a colour for each material"],
    body_parts: ["a colour for each part of the body"],
  }[layer] ?? [];
}

function numbers(frame) {
  const facts = [["Split", frame.split]];
  if (frame.sequence) facts.push(["Sequence", frame.sequence], ["Sensor", frame.sensor], ["Instant", `${frame.instant} (${decimal(frame.time, 3)} s)`]);
  if (frame.file) facts.push(["File", frame.file]);
  if (frame.pose) {
    const { azimuth, elevation, distance, tilt, name } = frame.pose;
    facts.push(["Azimuth", degrees(azimuth)], ["Elevation", degrees(elevation)], ["Distance", `${decimal(distance, 3)} m`],
      ["Tilt", degrees(tilt)], ["Side seen", poseName(name)]);
  } else {
    facts.push(["Camera", "not known"]);
  }
  return [table(facts), ...camera(frame), ...frame.objects.flatMap(object)];
}

function camera(frame) {
  if (!frame.camera) return [];
  if (frame.scan) {
    const [rings, columns] = frame.scan;
    const place = frame.camera.center.map((v) => decimal(v, 3)).join(", ");
    return [el("h3", {}, "LiDAR"), el("p", { class: "note" }, `${rings} rings × ${columns} columns; centre in the world ${place} m`)];
  }
  const rows = frame.camera.K.map((row) => el("tr", {}, ...row.map((v) => el("td", {}, decimal(v, 2)))));
  return [
    el("h3", {}, "Camera matrix K, pixels"),
    el("table", { class: "matrix" }, el("tbody", {}, ...rows)),
    el("p", { class: "note" },
      `${frame.size[0]} × ${frame.size[1]} px; centre in the world ${frame.camera.center.map((v) => decimal(v, 3)).join(", ")} m` +
      (frame.camera.distortion ? `; lens ${frame.camera.distortion}` : "")),
  ];
}

function object(o) {
  const rows = [];
  if (o.model) rows.push(["Model", o.model]);
  rows.push(["2D box", o.box ? o.box.map((v) => decimal(v, 1)).join(", ") : "not seen"], ["Visible pixels", count(o.area)]);
  if (o.visibility !== null) rows.push(["Visible share", percent(o.visibility)]);
  if (o.truncation !== null) rows.push(["Truncated share", percent(o.truncation)]);
  if (o.pose) rows.push(["Side seen", o.pose]);
  if (o.view) {
    const [azimuth, elevation, distance, tilt] = o.view;
    rows.push(["Seen from", `${degrees(azimuth)}, ${degrees(elevation)}, ${decimal(distance, 3)} m`]);
    if (Math.abs(tilt) > 0.05) rows.push(["Tilt", degrees(tilt)]);
  }
  if (o.size) {
    const [width, height, length] = o.size;
    rows.push(["Size", `${decimal(width)} × ${decimal(height)} × ${decimal(length)} m (width, height, length)`]);
  }
  return [
    el("h3", {}, el("i", { class: "swatch", style: `background:var(${categoryToken(o.category)})` }), `${categoryName(o.category)} ${o.id}`),
    table(rows),
  ];
}
