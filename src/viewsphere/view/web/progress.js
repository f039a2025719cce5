// How far the data set is: frames, speed, time left, failures.

import { facts, summary } from "report/data.js";
import { byId, count, decimal, el, percent, plural } from "report/dom.js";
import { figure, figureList } from "report/shell.js";

const bar = el("progress", { "aria-label": "Finished frames" });
const words = el("p", { class: "progress", role: "status" });
const figures = el("div", {});
const failed = el("details", { class: "failures", hidden: true }, el("summary", {}), el("ul", { class: "findings bad" }));

function duration(seconds) {
  if (seconds < 90) return `${Math.ceil(seconds)} s`;
  const minutes = Math.round(seconds / 60);
  if (minutes < 90) return `${minutes} min`;
  const hours = Math.round(minutes / 60);
  return hours < 48 ? `${hours} h` : `${Math.round(hours / 24)} d`;
}

/** What is said of a state, in a line. */
function said(state) {
  if (state.finished >= state.planned) {
    const others = state.leftOut ? ` ${plural(state.leftOut, "frame")} ${state.leftOut === 1 ? "was" : "were"} left out.` : "";
    return `All ${plural(state.planned, "frame")} are finished.${others}`;
  }
  const share = `${count(state.finished)} of ${plural(state.planned, "frame")} (${percent(state.finished / state.planned)})`;
  if (!state.rate) return state.age === null ? `${share}: none is finished yet.` : `${share}; the newest is ${duration(state.age)} old.`;
  return `${share}, ${decimal(state.rate, state.rate < 1 ? 2 : 1)} a second, about ${duration(state.left)} left.`;
}

export function showState(state) {
  bar.max = Math.max(1, state.planned);
  bar.value = state.finished;
  bar.hidden = state.finished >= state.planned;
  const reading = state.read < state.finished ? ` Labels are being read: ${percent(state.read / state.finished)}.` : "";
  const text = said(state) + reading;
  if (words.textContent !== text) words.textContent = text;
  words.classList.remove("bad");
  failed.hidden = !state.failed;
  if (failed.dataset.told !== JSON.stringify(state.failures)) {
    failed.dataset.told = JSON.stringify(state.failures);
    const more = state.failed - state.failures.length;
    failed.firstChild.textContent = `${plural(state.failed, "failure")}: models and shots that were left out or cannot be read`;
    failed.lastChild.replaceChildren(...state.failures.map(([key, why]) => el("li", {}, el("b", {}, key), `: ${why}`)),
      ...(more > 0 ? [el("li", {}, `and ${count(more)} more`)] : []));
  }
}

export function showSilence() {
  words.textContent = "The server does not answer: viewsphere view was ended? What is here stays.";
  words.classList.add("bad");
}

/** The numbers of what is counted so far. */
export function showFigures() {
  if (!summary.frames) return;
  figures.replaceChildren(figureList([
    figure(summary.objects, "object"),
    figure(summary.models.length, "model"),
    figure(summary.categories.length, "category", "categories"),
    ["pixels", summary.sizes.map(([w, h]) => `${w} × ${h}`).join(", ")],
  ]));
}

export function showOverview(state) {
  byId("overview").append(el("h1", {}, facts.name), words, bar, failed, figures);
  byId("brand").textContent = facts.name;
  showState(state);
}
