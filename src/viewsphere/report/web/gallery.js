// The pictures: what is drawn over them, filters, pages, cards.

import { categoryName, data, frameSize, poseName, shown, subject, summary } from "report/data.js";
import { byId, count, decimal, degrees, el, onLayout, percent, plural } from "report/dom.js";
import { openLightbox } from "report/lightbox.js";
import { draw } from "report/overlay.js";
import { EVERYTHING, LAYERS, filter, layers, matches, setFilter, subscribe, toggleLayer } from "report/state.js";

const PAGE = 24;
let page = 0;
let cards = [];

const hasObjects = shown.some((frame) => frame.objects.length);
const present = (layer) => {
  if (data.live) return layer.surface || layer.name === "tracks" ? data.live.layers.includes(layer.name) : true;
  if (layer.surface) return shown.some((frame) => frame.layers[layer.name]);
  if (layer.name === "tracks") return shown.some((frame) => frame.points?.length);
  if (layer.name === "boxes3d") return shown.some((frame) => frame.objects.some((o) => o.corners));
  return hasObjects;
};
const offered = LAYERS.filter(present);

/** Buttons that switch what is drawn; they follow the state, wherever it is changed. */
export function layerButtons() {
  const buttons = offered.map((layer) =>
    el("button", { type: "button", "data-layer": layer.name, onclick: () => toggleLayer(layer.name) },
      layer.label, el("kbd", { "aria-hidden": "true" }, layer.key)));
  const show = () => buttons.forEach((b) => b.setAttribute("aria-pressed", String(layers.has(b.dataset.layer))));
  subscribe("layers", show);
  show();
  return buttons;
}

/** A frame's picture with a canvas over it; `large` for the enlarged view; `room(frame)` gives its width and height on the page
 *  where somebody knows them. */
export function picture(frame, large, room = null) {
  const { width, height } = frameSize(frame);
  const canvas = el("canvas", { "aria-hidden": "true" });
  if (room) canvas.room = () => room(frame);
  const base = frame.layers.rgb
    ? el("img", { src: (large && frame.layers.rgbLarge) || frame.layers.rgb, alt: describe(frame), decoding: "async", onerror: unreadable })
    : el("span", { class: "missing" }, "no colour picture");
  const holder = el("span", { class: "picture", style: `aspect-ratio:${width}/${height};--ratio:${width / height}` }, base, canvas);
  return { holder, redraw: () => draw(canvas, frame, large) };
}

const unreadable = ({ target }) => target.replaceWith(el("span", { class: "missing" }, "the picture cannot be read"));

function describe(frame) {
  const pose = frame.pose ? `, azimuth ${degrees(frame.pose.azimuth)}, elevation ${degrees(frame.pose.elevation)}` : "";
  return `Frame ${frame.index}: ${subject(frame)}${pose}`;
}

/** A frame's card; a click enlarges it among those that `among()` gives; `room` as for `picture`. */
export function card(frame, among, room = null) {
  const { holder, redraw } = picture(frame, false, room);
  const first = frame.objects[0];
  const about = [
    frame.pose ? `${poseName(first?.pose || frame.pose.name)}` : first ? categoryName(first.category) : "",
    frame.sequence ? `${frame.sensor} ${decimal(frame.time, 3)} s` : "",
    first && first.visibility !== null && first.visibility < 0.9995 ? `${percent(first.visibility)} visible` : "",
    frame.split,
  ].filter(Boolean).join(" · ");
  const node = el("button", { type: "button", class: "card", "data-frame": frame.index, onclick: () => openLightbox(frame, among()) },
    holder, el("span", { class: "title" }, subject(frame)), el("span", { class: "about" }, about));
  return { node, redraw };
}

/** Frames in turns, one of each subject after the other, so that a page shows what there is. */
function mixed(frames) {
  const groups = Map.groupBy(frames, subject);
  const turns = Math.max(0, ...[...groups.values()].map((group) => group.length));
  return Array.from({ length: turns }, (_, turn) => [...groups.values()].map((group, i) => spreadOut(group, turn, i))).flat().filter(Boolean);
}

/** The group's frames in an order that jumps about its poses: by multiples of the golden ratio. */
function spreadOut(group, turn, shift) {
  group.jumping ??= group.map((frame, i) => [((i + shift) * 0.6180339887) % 1, frame]).sort((a, b) => a[0] - b[0]).map(([, frame]) => frame);
  return group.jumping[turn];
}

const inTurns = mixed(shown);

const found = () => (filter.order === "frame" ? shown : inTurns).filter(matches);

function showPage() {
  const frames = found();
  const pages = Math.max(1, Math.ceil(frames.length / PAGE));
  page = Math.min(page, pages - 1);
  cards = frames.slice(page * PAGE, (page + 1) * PAGE).map((frame) => card(frame, found));
  const nothing = el("p", { class: "empty" }, "No picture on this page meets these filters. ",
    el("button", { type: "button", onclick: () => setFilter({ ...EVERYTHING }) }, "Show all"));
  byId("grid").replaceChildren(...(cards.length ? cards.map((c) => c.node) : [nothing]));
  cards.forEach((c) => c.redraw());
  const step = (label, change, off) =>
    el("button", { type: "button", disabled: off, "data-step": change, onclick: () => turnTo(page + change) }, label);
  byId("pages").replaceChildren(
    step("← Previous", -1, page === 0), el("span", {}, `Page ${page + 1} of ${pages}`), step("Next →", 1, page === pages - 1));
  byId("pages").hidden = pages === 1;
  byId("matches").textContent = frames.length === shown.length ? "" : `${plural(frames.length, "picture")} of ${count(shown.length)} shown here`;
}

function turnTo(wanted) {
  const forward = wanted > page;
  page = wanted;
  showPage();
  byId("pictures").scrollIntoView();
  const button = byId("pages").querySelector(`[data-step="${forward ? 1 : -1}"]`);
  if (!button.disabled) button.focus({ preventScroll: true });
}

/** A list of what one may be asked for, none where there is no choice. */
export function choice(label, name, options) {
  const select = el("select", { name, onchange: (event) => setFilter({ [name]: event.target.value }) },
    el("option", { value: "" }, "all"), ...options.map(([value, text]) => el("option", { value }, text)));
  subscribe("filter", () => (select.value = filter[name]));
  return options.length > 1 ? el("label", {}, label, select) : null;
}

function orderChoice() {
  const select = el("select", { name: "order", onchange: (event) => setFilter({ order: event.target.value }) },
    el("option", { value: "mixed" }, "mixed"), el("option", { value: "frame" }, "by frame"));
  subscribe("filter", () => (select.value = filter.order));
  return el("label", {}, "Order", select);
}

function visibilityRange() {
  const slider = (name, label, value) => {
    const input = el("input", { type: "range", min: 0, max: 100, step: 1, value, name, "aria-label": label });
    input.addEventListener("input", () => {
      const wanted = Number(input.value) / 100;
      setFilter(name === "low" ? { low: Math.min(wanted, filter.high) } : { high: Math.max(wanted, filter.low) });
    });
    return input;
  };
  const low = slider("low", "Least visible share, percent", 0);
  const high = slider("high", "Greatest visible share, percent", 100);
  const output = el("output", {}, "");
  const show = () => {
    low.value = Math.round(filter.low * 100);
    high.value = Math.round(filter.high * 100);
    output.textContent = `${decimal(filter.low * 100, 0)}–${decimal(filter.high * 100, 0)} %`;
  };
  subscribe("filter", show);
  show();
  return el("fieldset", {}, el("legend", {}, "Visible share"), el("div", {}, low, high, output));
}

export function cellChip() {
  const chip = el("button", { type: "button", class: "chip", onclick: () => setFilter({ cell: null }) });
  const show = () => {
    chip.hidden = !filter.cell;
    if (filter.cell) chip.textContent = `Cell ${filter.cell.label} ✕`;
  };
  subscribe("filter", show);
  show();
  return chip;
}

export function reset() {
  const button = el("button", { type: "button", class: "quiet", onclick: () => setFilter({ ...EVERYTHING }) }, "Reset");
  const untouched = () => (button.hidden = Object.entries(EVERYTHING).every(([name, value]) => filter[name] === value));
  subscribe("filter", untouched);
  untouched();
  return button;
}

function filterRow() {
  const distinct = (values) => [...new Set(values)].sort((a, b) => a.localeCompare(b, "en", { numeric: true }));
  const objects = shown.flatMap((frame) => frame.objects);
  const models = distinct(objects.map((o) => o.model).filter(Boolean));
  const poses = distinct(objects.map((o) => poseName(o.pose)));
  const categories = summary.categories.filter((c) => objects.some((o) => o.category === c.id));
  return [
    choice("Category", "category", categories.map((c) => [String(c.id), c.name])),
    choice("Model", "model", models.map((key) => [key, key])),
    choice("Split", "split", distinct(shown.map((frame) => frame.split)).map((name) => [name, name])),
    choice("Side seen", "pose", poses.map((name) => [name, name])),
    hasObjects ? visibilityRange() : null,
    orderChoice(),
    cellChip(),
    reset(),
  ].filter(Boolean);
}

function arrows(event) {
  const moves = { ArrowLeft: -1, ArrowRight: 1 };
  const at = cards.findIndex((c) => c.node === document.activeElement);
  if (at < 0 || !(event.key in moves)) return;
  cards[at + moves[event.key]]?.node.focus();
  event.preventDefault();
}

/** The letters of the layers' buttons. */
export function layerKeys(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
  const layer = offered.find((l) => l.key === event.key.toLowerCase());
  if (layer) toggleLayer(layer.name);
}

export function showGallery() {
  const part = shown.length < summary.frames
    ? `${count(shown.length)} of ${plural(summary.frames, "frame")}, chosen evenly over models, splits and poses.`
    : `All ${plural(summary.frames, "frame")}.`;
  const unfinished = summary.planned > summary.frames ? ` ${count(summary.planned - summary.frames)} of the plan's ${count(summary.planned)} are not rendered yet.` : "";
  byId("pictures-lead").textContent = `${part}${unfinished} Choose what is drawn over them; select a picture to enlarge it.`;
  byId("layers").append(...layerButtons());
  byId("filters").append(...filterRow());
  byId("grid").addEventListener("keydown", arrows);
  document.addEventListener("keydown", layerKeys);
  subscribe("filter", () => {
    page = 0;
    showPage();
  });
  subscribe("layers", () => cards.forEach((c) => c.redraw()));
  showPage();
  onLayout(byId("grid"), () => cards.forEach((c) => c.redraw()));
}
