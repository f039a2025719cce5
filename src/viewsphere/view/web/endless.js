// A wall of pictures without end: only cards in sight are made, and only their rows are asked for, in pieces.

import { byId, el, onLayout } from "report/dom.js";
import { card } from "report/gallery.js";
import { subscribe } from "report/state.js";

const PIECE = 24;
const HELD = 40; // pieces that are kept
const TALL = 8e6; // pixels that every browser scrolls over; some end at 16 million
const STILL = 60; // ms that a place is in sight before it is asked for, once one scrolls
const SYNC = 150; // ms without scrolling after which the scroll bar is put right
const WORDS = 2.9; // a card's lines and their margin, rem
const GAP = [0.9, 1.1]; // between columns and rows, rem

let fetchRows = null;
let heard = () => {};
let total = 0;
let pieces = new Map();
let cards = new Map();
let top = 0; // pixels above the sight, were the wall as tall as it is
let scrolled = 0; // where the scroll bar was
let ratio = 4 / 3;
let series = 0; // counts the answers that begin anew
let due = 0;
let syncing = 0;
let grid = { columns: 4, width: 300, height: 225, row: 290, rem: 16 };

const box = byId("grid");
const space = el("div", { class: "space" });

const rowAt = (place) => pieces.get(Math.floor(place / PIECE))?.rows?.[place % PIECE];
const tallness = () => Math.ceil(total / grid.columns) * grid.row;

/** How many frames there are, and any of them, for those who turn from one to the next. */
const all = () => ({
  length: total,
  indexOf: (frame) => frame.place,
  at: (place) => rowAt(place) ?? piece(Math.floor(place / PIECE)).then(() => rowAt(place)),
});

function layOut() {
  const rem = parseFloat(getComputedStyle(document.documentElement).fontSize);
  const room = space.clientWidth;
  const columns = room < 560 ? 2 : room < 920 ? 3 : 4;
  const width = (room - (columns - 1) * GAP[0] * rem) / columns;
  const height = width / ratio;
  const before = grid;
  grid = { columns, width, height, row: height + (WORDS + GAP[1]) * rem, rem };
  const first = Math.floor(top / before.row) * before.columns;
  space.style.setProperty("--width", `${width}px`);
  space.style.setProperty("--height", `${height}px`);
  space.style.height = `${Math.min(TALL, tallness())}px`;
  goTo(Math.floor(first / columns) * grid.row);
  cards.forEach((one) => one.redraw());
}

/** Show the wall from so many pixels on. */
function goTo(pixels) {
  const hidden = Math.max(0, tallness() - box.clientHeight);
  top = Math.max(0, Math.min(hidden, pixels));
  putBarRight();
  render();
}

/** The scroll bar stands where the sight is; a wall taller than it can be is scrolled by its share. */
function putBarRight() {
  const hidden = tallness() - box.clientHeight;
  const bar = Math.min(TALL, tallness()) - box.clientHeight;
  const wanted = hidden > bar ? (top / hidden) * bar : top;
  if (Math.abs(box.scrollTop - wanted) > 1) box.scrollTop = wanted;
  scrolled = box.scrollTop;
}

function follow() {
  const hidden = tallness() - box.clientHeight;
  const bar = Math.min(TALL, tallness()) - box.clientHeight;
  const moved = box.scrollTop - scrolled;
  scrolled = box.scrollTop;
  const isAtEnd = scrolled <= 0 || scrolled >= bar - 1;
  // A wheel moves the wall by as much as the page; who drags the bar means a place of the whole.
  if (hidden <= bar) top = scrolled;
  else if (isAtEnd || Math.abs(moved) > 2 * box.clientHeight) top = (scrolled / bar) * hidden;
  else top = Math.max(0, Math.min(hidden, top + moved));
  clearTimeout(syncing);
  if (hidden > bar) syncing = setTimeout(() => { putBarRight(); render(); }, SYNC);
  render();
}

function inSight() {
  const first = Math.max(0, Math.floor(top / grid.row) - 1) * grid.columns;
  const last = Math.min(total, (Math.ceil((top + box.clientHeight) / grid.row) + 1) * grid.columns);
  return [first, last];
}

function make(row, place) {
  if (!row) return { node: waiting(), redraw: () => {} };
  row.place = place;
  if (!row.problem) return card(row, all);
  const words = el("span", { class: "missing" }, "cannot be read");
  return { node: el("div", { class: "card", "data-frame": row.index, title: row.problem },
    el("span", { class: "picture" }, words), el("span", { class: "title" }, `Frame ${row.index}`), el("span", { class: "about bad" }, row.problem)),
    redraw: () => {} };
}

const waiting = () => el("div", { class: "card waiting", "aria-hidden": "true" },
  el("span", { class: "picture" }), el("span", { class: "title" }, " "), el("span", { class: "about" }, " "));

function render() {
  const [first, last] = inSight();
  const wanted = new Map();
  const fresh = [];
  for (let place = first; place < last; place++) {
    const row = rowAt(place);
    const name = row ? `frame ${row.index}` : `place ${place}`;
    let one = cards.get(name);
    if (!one) fresh.push((one = make(row, place)));
    else if (row) row.place = place;
    const x = (place % grid.columns) * (grid.width + GAP[0] * grid.rem);
    const y = Math.floor(place / grid.columns) * grid.row - top + box.scrollTop;
    one.node.style.transform = `translate(${x}px, ${y}px)`;
    one.node.dataset.place = place;
    wanted.set(name, one);
  }
  cards.forEach((one, name) => { if (!wanted.has(name)) one.node.remove(); });
  let cursor = space.firstChild;
  wanted.forEach(({ node }) => {
    if (node === cursor) cursor = cursor.nextSibling;
    else space.insertBefore(node, cursor);
  });
  cards = wanted;
  fresh.forEach((one) => one.redraw());
  clearTimeout(due);
  due = setTimeout(askForSight, STILL);
}

function askForSight() {
  const [first, last] = inSight();
  const [from, to] = [Math.floor(first / PIECE), Math.floor((last - 1) / PIECE)];
  for (const [number, one] of pieces) {
    if (!one.rows && (number < from || number > to)) {
      one.stop.abort();
      pieces.delete(number);
    } else if (pieces.size > HELD && (number < from - 4 || number > to + 4)) pieces.delete(number);
  }
  for (let number = from; number <= to; number++) if (!pieces.has(number)) piece(number);
}

/** A piece of the wall, once it is there; one that cannot be had is asked for again by those who look at it later. */
function piece(number) {
  const known = pieces.get(number);
  if (known) return known.promise;
  const one = { rows: null, stop: new AbortController() };
  const own = pieces;
  own.set(number, one);
  one.promise = fetchRows(number * PIECE, PIECE, one.stop.signal).then((answer) => {
    one.rows = answer.rows;
    if (own === pieces) render();
  }, () => own.delete(number));
  return one.promise;
}

/** Begin anew: from the top, or where one is, in which case what is in sight stays until the answer is there. `fetch(first, count,
 *  signal)` gives `total` and `rows`; `tell(answer)` is called with the first answer, or with an error's words.
 */
export async function begin(fetch, tell, stay = false) {
  const own = (series += 1);
  heard = tell;
  const number = stay ? Math.floor(inSight()[0] / PIECE) : 0;
  let answer;
  try {
    answer = await fetch(number * PIECE, PIECE);
  } catch (error) {
    if (own === series) tell(null, error.message);
    return;
  }
  if (own !== series) return;
  fetchRows = fetch;
  pieces.forEach((one) => one.stop.abort());
  pieces = new Map([[number, { rows: answer.rows, promise: Promise.resolve(), stop: new AbortController() }]]);
  total = answer.total;
  const size = answer.rows.find((row) => row.size)?.size;
  if (size) ratio = Math.max(0.6, Math.min(2.4, size[0] / size[1]));
  if (!stay) top = 0;
  layOut();
  heard(answer);
}

export const isAtTop = () => top < grid.row;

function keys(event) {
  const moves = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -grid.columns, ArrowDown: grid.columns };
  const at = Number(document.activeElement.closest?.(".card")?.dataset.place ?? NaN);
  const to = at + moves[event.key];
  if (!(to >= 0 && to < total)) return;
  event.preventDefault();
  const y = Math.floor(to / grid.columns) * grid.row;
  if (y < top) goTo(y);
  else if (y + grid.row > top + box.clientHeight) goTo(y + grid.row - box.clientHeight);
  space.querySelector(`[data-place="${to}"]`)?.focus({ preventScroll: true });
}

export function showWall() {
  box.classList.add("endless");
  box.tabIndex = 0;
  box.setAttribute("aria-label", "Pictures; scroll for more");
  box.append(space);
  box.addEventListener("scroll", follow, { passive: true });
  box.addEventListener("keydown", keys);
  subscribe("layers", () => cards.forEach((one) => one.redraw()));
  onLayout(box, layOut);
}
