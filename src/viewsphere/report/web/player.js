// Sequences: a player with the sensors side by side, a filmstrip, and the rig among the objects in 3D.

import { frameSize, sequences, shown, summary } from "report/data.js";
import { byId, count, decimal, el, onLayout, plural } from "report/dom.js";
import { layerButtons } from "report/gallery.js";
import { legend, openLightbox } from "report/lightbox.js";
import { draw } from "report/overlay.js";
import { showRig } from "report/scenes/rig3d.js";
import { subscribe } from "report/state.js";

const TAIL = 8;
const THUMBS = 8;
const SPEEDS = [["0.25", "¼ ×"], ["0.5", "½ ×"], ["1", "1 ×"], ["2", "2 ×"]];

let sequence = null;
let at = 0;
let playing = 0;
let parts = null;
let rig = null;

const framesAt = (instant) => sequence.frames[instant].map((row) => shown[row]);

/** A sensor's frames before an instant, in order. */
function before(instant, sensor) {
  const rows = sequence.frames.slice(Math.max(0, instant - TAIL), instant);
  return rows.map((row) => shown[row[sensor]]).filter((frame) => frame.points);
}

function show(instant) {
  at = instant;
  const frames = framesAt(at);
  parts.canvases.forEach((canvas, i) => draw(canvas, frames[i], false, true, before(at, i)));
  parts.slider.value = at;
  parts.output.textContent = `instant ${sequence.instants[at]}, ${decimal(sequence.times[at], 3)} s`;
  parts.legend.replaceChildren(...legend(frames[0]));
  const near = parts.thumbs.reduce((best, thumb) => (Math.abs(thumb.at - at) < Math.abs(best.at - at) ? thumb : best));
  parts.thumbs.forEach((thumb) => thumb.node.setAttribute("aria-current", String(thumb === near)));
  rig?.show(frames);
}

/** Plays in the time of the sequence, from where it is, again and again. */
function play() {
  const lengths = sequence.seconds;
  let since = performance.now();
  const step = (now) => {
    const speed = Number(parts.speed.value);
    let next = at;
    while (now - since >= (1000 * lengths[next]) / speed) {
      since += (1000 * lengths[next]) / speed;
      next = (next + 1) % lengths.length;
      if (now - since > 2000) since = now; // the page was not to be seen
    }
    if (next !== at) show(next);
    playing = requestAnimationFrame(step);
  };
  playing = requestAnimationFrame(step);
  mark();
}

function pause() {
  cancelAnimationFrame(playing);
  playing = 0;
  mark();
}

function mark() {
  parts.button.textContent = playing ? "❚❚ Pause" : "▶ Play";
  parts.button.setAttribute("aria-pressed", String(Boolean(playing)));
}

function seek(instant) {
  if (playing) pause();
  show(Math.max(0, Math.min(sequence.frames.length - 1, instant)));
}

function sensorView(frame, name, i) {
  const { width, height } = frameSize(frame);
  const canvas = el("canvas", { role: "img", "aria-label": `Sensor ${name}` });
  const holder = el("span", { class: "picture", style: `aspect-ratio:${width}/${height}` }, canvas);
  const open = el("button", { type: "button", class: "card", "aria-label": `Enlarge ${name}`, onclick: () => {
    pause();
    openLightbox(framesAt(at)[i], sequence.frames.map((row) => shown[row[i]]));
  } }, holder);
  open.style.width = "100%";
  const words = sequence.sensors.length > 1 ? el("figcaption", {}, name) : null;
  return { canvas, node: el("figure", { class: "sensor", style: `--ratio:${width / height}` }, open, words) };
}

function thumbnails() {
  const last = sequence.frames.length - 1;
  const number = Math.min(THUMBS, last + 1);
  const picks = [...new Set(Array.from({ length: number }, (_, i) => (number > 1 ? Math.round((i * last) / (number - 1)) : 0)))];
  return picks.map((instant) => {
    const frame = framesAt(instant)[0];
    const picture = frame.layers.rgb ? el("img", { src: frame.layers.rgb, alt: "", decoding: "async", loading: "lazy" }) : null;
    const node = el("button", { type: "button", "aria-label": `Instant ${sequence.instants[instant]}`, onclick: () => seek(instant) },
      picture, `${decimal(sequence.times[instant], 3)} s`);
    return { at: instant, node };
  });
}

function keys(event) {
  const moves = { ArrowLeft: -1, ArrowRight: 1 };
  if (event.target === parts.slider || !(event.key in moves)) return;
  seek(at + moves[event.key]);
  event.preventDefault();
}

function choose(name) {
  if (playing) pause();
  sequence = sequences.find((one) => one.name === name);
  const views = sequence.sensors.map((sensor, i) => sensorView(framesAt(0)[i], sensor, i));
  parts.canvases = views.map((view) => view.canvas);
  parts.sensors.replaceChildren(...views.map((view) => view.node));
  parts.thumbs = thumbnails();
  byId("filmstrip").replaceChildren(...parts.thumbs.map((thumb) => thumb.node));
  parts.slider.max = sequence.frames.length - 1;
  const some = sequence.frames.length < sequence.whole ? `${sequence.frames.length} of ${plural(sequence.whole, "instant")}` : plural(sequence.whole, "instant");
  const rate = 1 / sequence.seconds[0];
  parts.facts.textContent = `${some}, ${decimal(rate, 2)} a second` + (sequence.frames.length < sequence.whole ? " here" : "");
  rig?.choose(sequence.frames.map((row) => row.map((i) => shown[i])));
  show(0);
}

function prepare() {
  const button = el("button", { type: "button", onclick: () => (playing ? pause() : play()) });
  const slider = el("input", { type: "range", min: 0, value: 0, step: 1, "aria-label": "Instant" });
  slider.addEventListener("input", () => seek(Number(slider.value)));
  const speed = el("select", { name: "speed", "aria-label": "Speed" }, ...SPEEDS.map(([value, text]) => el("option", { value, selected: value === "1" }, text)));
  parts = { button, slider, speed, output: el("output", {}), sensors: el("div", { class: "sensors" }), legend: el("div", { class: "ramp" }),
    facts: el("span", { class: "matches" }), canvases: [], thumbs: [] };
  byId("player").append(parts.sensors, parts.legend, el("div", { class: "controls" }, button, slider, parts.output, speed));
  byId("player").addEventListener("keydown", keys);
}

export function showPlayer() {
  if (!sequences.length) return;
  byId("sequences").hidden = byId("to-sequences").hidden = false;
  prepare();
  const select = el("select", { name: "sequence", onchange: () => choose(select.value) }, ...sequences.map((one) => el("option", { value: one.name }, one.name)));
  const some = sequences.length < summary.sequences ? `${count(sequences.length)} of ${plural(summary.sequences, "sequence")}, spread evenly.` : `${plural(sequences.length, "sequence")}.`;
  byId("sequences-lead").textContent = `${some} Choose what is drawn; arrow keys step, a picture enlarges.`;
  byId("sequence-choice").append(el("label", {}, "Sequence", select), parts.facts);
  byId("sequence-layers").append(...layerButtons());
  const stage = el("div", { class: "stage", id: "rig-stage" });
  const caption = el("figcaption", { id: "rig-caption" });
  byId("rig").append(stage, caption);
  rig = showRig(stage, caption);
  subscribe("layers", () => show(at));
  choose(sequences[0].name);
  mark();
  onLayout(byId("player"), () => show(at));
}
