// Puts the page of a server together: first the pictures, then what is counted over all of them, again and again.

import { data, facts, renew, shown } from "report/data.js";
import { byId } from "report/dom.js";
import { showProvenance } from "report/provenance.js";
import { markSection, theme } from "report/shell.js";
import { tell } from "report/state.js";
import { ask, askIfAny } from "own/ask.js";
import { follow, showPictures } from "own/pictures.js";
import { showFigures, showOverview, showSilence, showState } from "own/progress.js";

const OFTEN = 1000; // ms between two questions while something happens
const SELDOM = 4000;
const PYRAMIDS = 24; // frames that are shown among a model's cameras
const COUNTED = 10000; // ms between two counts of all frames

const live = data.live;
live.range = (frame, layer) => askIfAny("range", { frame: frame.index, layer });
live.model = async (key) => {
  const [model, answer] = await Promise.all([askIfAny("model", { key }), askIfAny("rows", { model: key, order: "mixed", first: 0, count: PYRAMIDS })]);
  shown.splice(0, shown.length, ...(answer?.rows ?? []).filter((row) => row.objects));
  return model;
};

const sections = {
  viewpoints: async () => (await import("report/scenes/sphere.js")).showSphere(),
  distributions: async () => (await import("report/charts.js")).showDistributions(),
  models: async () => (await import("report/scenes/models.js")).showModels(),
};
const drawn = new Set();
let counted = 0;
let countedAt = -Infinity;

/** Draws a section when somebody comes near it: the libraries that it needs take longer than all else of the page. */
const watcher = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) {
    if (!isIntersecting) continue;
    watcher.unobserve(target);
    drawSection(target.id);
  }
}, { rootMargin: "400px" });

async function drawSection(name) {
  await import("own/vendor.js");
  await sections[name]();
  drawn.add(name);
  byId(name).classList.remove("empty-yet");
}

/** Count all frames whose labels are read, if there are more than before. */
async function recount(state) {
  const isDone = state.read >= state.finished;
  if (!state.read || state.read === counted || (!isDone && performance.now() - countedAt < COUNTED)) return;
  countedAt = performance.now();
  const first = !counted;
  const found = await ask("summary");
  counted = found.frames ? found.read : counted; // the server does not count anew each time
  if (!found.frames) return;
  renew(found);
  showFigures();
  if (first) {
    for (const name of Object.keys(sections)) {
      byId(name).hidden = false;
      byId(name).classList.add("empty-yet");
      watcher.observe(byId(name));
    }
  }
  if (drawn.has("distributions")) sections.distributions();
  tell("summary");
  document.documentElement.dataset.counted = found.frames;
}

async function look() {
  if (!document.hidden) {
    try {
      live.state = await ask("state");
      showState(live.state);
      follow(live.state);
      await recount(live.state);
    } catch {
      showSilence();
    }
  }
  const { finished, planned, rate, read } = live.state;
  const happens = read < finished || (finished < planned && rate > 0);
  setTimeout(look, happens ? OFTEN : SELDOM);
}

async function provenance() {
  Object.assign(facts, await ask("facts"));
  showProvenance();
}

theme();
showOverview(live.state);
for (const name of Object.keys(sections)) byId(name).hidden = true;
markSection();
document.documentElement.dataset.ready = "true";
await showPictures(); // before anything else is asked for
look();
provenance();
