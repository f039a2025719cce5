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

const sections = ["viewpoints", "distributions", "models"];
let counted = 0;
let countedAt = -Infinity;

/** The sections that need the libraries, which are loaded when there is something to count. */
async function libraries() {
  await import("own/vendor.js");
  const [{ showDistributions }, { showModels }, { showSphere }] =
    await Promise.all(["charts", "models", "sphere"].map((name) => import(`report/${name}.js`)));
  return { showDistributions, showModels, showSphere };
}

/** Count all frames whose labels are read, if there are more than before. */
async function recount(state) {
  const isDone = state.read >= state.finished;
  if (!state.read || state.read === counted || (!isDone && performance.now() - countedAt < COUNTED)) return;
  countedAt = performance.now();
  const first = !counted;
  const [found, show] = await Promise.all([ask("summary"), libraries()]);
  counted = found.frames ? state.read : counted;
  if (!found.frames) return;
  renew(found);
  showFigures();
  if (first) {
    for (const name of sections) byId(name).hidden = false;
    show.showSphere();
    show.showModels();
  }
  show.showDistributions();
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
for (const name of sections) byId(name).hidden = true;
showPictures();
markSection();
document.documentElement.dataset.ready = "true";
requestIdleCallback(() => {
  look();
  provenance();
});
