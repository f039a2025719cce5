// The pictures: which of them, in which order, and how those that come while one looks are shown.

import { data, poseName, summary } from "report/data.js";
import { byId, count, el, plural } from "report/dom.js";
import { cellChip, choice, layerButtons, layerKeys, reset } from "report/gallery.js";
import { EVERYTHING, filter, setFilter, subscribe } from "report/state.js";
import { ask } from "own/ask.js";
import { begin, isAtTop, showWall } from "own/endless.js";

const SOON = 250; // ms that a filter stands still before it is asked for
const ORDERS = [["newest", "newest first"], ["frame", "by frame"], ["mixed", "mixed"]];

const live = data.live;
let known = { listed: 0, read: 0 }; // what the pictures in sight are of
let state = live.state;
let due = 0;
let busy = false;

/** The filter as the server understands it. */
function query() {
  const { category, model, split, pose, cell, order, measure, least, most } = filter;
  const within = {};
  if (cell) {
    const front = cell.of === "cameras" ? "camera_" : "";
    within[`${front}azimuth`] = cell.azimuth.join(",");
    within[`${front}elevation`] = cell.elevation.join(",");
  }
  if (measure && (least !== "" || most !== "")) within[measure] = [least, most].map((end) => asKept(measure, end)).join(",");
  return { category, model, split, pose, order, ...within };
}

const isShare = (name) => live.measures.find((one) => one.name === name)?.unit === "%";
const asKept = (name, typed) => (typed !== "" && isShare(name) ? String(Number(typed) / 100) : typed);

function show(stay) {
  clearTimeout(due);
  busy = true;
  const asked = query();
  const own = { listed: "", read: "" };
  const fetchRows = async (first, n, signal) => {
    const answer = await ask("rows", { ...asked, ...own, first, count: n }, signal);
    Object.assign(own, { listed: answer.listed, read: answer.read });
    return answer;
  };
  return begin(fetchRows, (answer, problem) => {
    busy = false;
    if (answer) known = { ...own, total: answer.total, searched: answer.searched, needsLabels: answer.needsLabels };
    tell(problem);
  }, stay);
}

function tell(problem) {
  const fresh = known.needsLabels ? state.read - known.read : state.finished - known.listed;
  const of = known.needsLabels || known.total !== known.searched ? ` of ${plural(known.searched, "frame")}` : "";
  const reading = known.needsLabels && known.read < state.finished ? `, the labels of ${count(state.finished - known.read)} are not read yet` : "";
  const words = problem ?? `${plural(known.total, "picture")}${of}${reading}`;
  const more = fresh > 0 ? el("button", { type: "button", class: "link fresh", onclick: () => show(false) }, `Show ${count(fresh)} more`) : null;
  byId("matches").replaceChildren(...[known.total || problem || !state.finished ? words : "No picture meets these filters.", more].filter(Boolean));
}

/** Take in how far the data set is: who is at the top sees what comes, who has scrolled on is told. */
export function follow(now) {
  state = now;
  const fresh = known.needsLabels ? state.read > known.read : state.finished > known.listed;
  if (fresh && !busy && isAtTop() && !byId("lightbox").open) show(true);
  else if (!busy) tell();
}

function measureRange() {
  const field = (name, label) => {
    const input = el("input", { type: "number", name, step: "any", placeholder: label, "aria-label": label,
      oninput: () => setFilter({ [name]: input.value }) });
    return input;
  };
  const [least, most] = [field("least", "least"), field("most", "most")];
  const select = el("select", { name: "measure", "aria-label": "Label", onchange: () => setFilter({ measure: select.value }) },
    el("option", { value: "" }, "any label"), ...live.measures.map(({ name, words, unit }) => el("option", { value: name }, unit ? `${words}, ${unit}` : words)));
  const follow = () => {
    select.value = filter.measure;
    for (const input of [least, most]) {
      if (input.value !== filter[input.name]) input.value = filter[input.name];
      input.hidden = !filter.measure;
    }
  };
  subscribe("filter", follow);
  follow();
  return el("fieldset", {}, el("legend", {}, "Label between"), el("div", {}, select, least, most));
}

function orderChoice() {
  const sorted = live.measures.flatMap(({ name, words }) => [[name, `${words}, least first`], [`-${name}`, `${words}, greatest first`]]);
  const select = el("select", { name: "order", onchange: () => setFilter({ order: select.value }) },
    ...[...ORDERS, ...sorted].map(([value, words]) => el("option", { value }, words)));
  const follow = () => (select.value = filter.order);
  subscribe("filter", follow);
  follow();
  return el("label", {}, "Order", select);
}

/** The lists of what there is grow with it. */
function lists() {
  const names = (rows) => rows.map((row) => [row.name ?? row.key, poseName(row.name ?? row.key)]);
  return [
    choice("Category", "category", summary.categories.map((c) => [String(c.id), c.name])),
    choice("Model", "model", names(summary.models)),
    choice("Split", "split", names(summary.splits ?? [])),
    choice("Side seen", "pose", (summary.poses ?? []).map(({ name }) => [name, poseName(name)])),
  ].filter(Boolean);
}

function showLists() {
  byId("lists").replaceChildren(...lists());
  byId("lists").querySelectorAll("select").forEach((select) => (select.value = filter[select.name]));
}

/** Show the first pictures; done when the server has told of them, or why it cannot. */
export function showPictures() {
  const order = state.finished < state.planned ? "newest" : "mixed";
  Object.assign(filter, Object.assign(EVERYTHING, { order, measure: "", least: "", most: "" }));
  byId("pictures-lead").textContent = "All finished frames. Choose what is drawn over them; select one to enlarge it.";
  byId("layers").append(...layerButtons());
  byId("filters").append(el("div", { id: "lists", class: "lists" }), measureRange(), orderChoice(), cellChip(), reset());
  byId("pages").hidden = true;
  document.addEventListener("keydown", layerKeys);
  showLists();
  showWall();
  subscribe("summary", showLists);
  subscribe("filter", () => {
    clearTimeout(due);
    due = setTimeout(() => show(false), SOON);
  });
  return show(false);
}
