// A wall of pictures without end: only cards in sight are made, and only their rows are asked for, in pieces.
//
// While one scrolls, nothing of the page is measured, and no card that stays is touched: all sizes are known since `layOut`.

import { byId, el, onLayout } from "report/dom.js";
import { card } from "report/gallery.js";
import { subscribe } from "report/state.js";

const PIECE = 12;
const HELD = 80; // pieces that are kept
const TALL = 8e6; // pixels that every browser scrolls over; some end at 16 million
const FAST = 0.5; // heights of the wall in one step from which on one is taken to be on the way to somewhere else
const STILL = 60; // ms that a place is in sight before it is asked for, if one was fast
const AT_ONCE = 6; // cards that are made for one picture of the screen
const WORDS = 2.9; // a card's lines and their margin, rem
const GAP = [0.9, 1.1]; // between columns and rows, rem

let fetchRows = null;
let heard = () => {};
let total = 0;
let pieces = new Map();
let cards = new Map();
let top = 0; // pixels above the sight, were the wall as tall as it is
let scrolled = 0; // where the scroll bar is
let down = true; // the way one scrolls
let ratio = 4 / 3;
let series = 0; // counts the answers that begin anew
let due = 0;
let painting = 0;
let grid = { columns: 4, width: 300, height: 225, gap: 14, row: 290, sight: 600 };

const box = byId("grid");
const space = el("div", { class: "space" });

const rowAt = (place) => pieces.get(Math.floor(place / PIECE))?.rows?.[place % PIECE];
const tallness = () => Math.ceil(total / grid.columns) * grid.row;
const hidden = () => Math.max(0, tallness() - grid.sight);
const bar = () => Math.max(0, Math.min(TALL, tallness()) - grid.sight);
const roomOf = ({ size: [width, height] }) => [Math.min(grid.width, (grid.height * width) / height), grid.height];

/** How many frames there are, and any of them, for those who turn from one to the next; `show` brings one into sight. */
const all = () => ({
  length: total,
  indexOf: (frame) => frame.place,
  at: (place) => rowAt(place) ?? piece(Math.floor(place / PIECE)).then(() => rowAt(place)),
  show: bringIntoSight,
});

function layOut() {
  const rem = parseFloat(getComputedStyle(document.documentElement).fontSize);
  const room = space.clientWidth;
  const sight = box.clientHeight;
  const columns = room < 560 ? 2 : room < 920 ? 3 : 4;
  const gap = GAP[0] * rem;
  const width = (room - (columns - 1) * gap) / columns;
  const height = Math.round(width / ratio);
  const first = Math.floor(top / grid.row) * grid.columns;
  const isAsBefore = columns === grid.columns && width === grid.width && height === grid.height;
  if (!isAsBefore) top = 0;
  grid = { columns, width, height, gap, row: height + Math.ceil((WORDS + GAP[1]) * rem), sight };
  space.style.setProperty("--width", `${width}px`);
  space.style.setProperty("--height", `${height}px`);
  space.style.height = `${Math.min(TALL, tallness())}px`;
  goTo(isAsBefore ? top : Math.floor(first / columns) * grid.row);
  if (!isAsBefore) redraw();
}

const redraw = () => cards.forEach((one) => one.redraw());

/** Show the wall from so many pixels on. */
function goTo(pixels) {
  top = Math.max(0, Math.min(hidden(), Math.round(pixels)));
  putBarRight();
  render();
  askForSight();
}

function bringIntoSight(place) {
  const y = Math.floor(place / grid.columns) * grid.row;
  if (y < top) goTo(y);
  else if (y + grid.row > top + grid.sight) goTo(y + grid.row - grid.sight);
}

/** The scroll bar stands where the sight is; a wall taller than it can be is scrolled by its share. */
function putBarRight() {
  const wanted = hidden() > bar() ? Math.round((top / hidden()) * bar()) : top;
  if (Math.abs(scrolled - wanted) > 1) box.scrollTop = wanted;
  scrolled = box.scrollTop;
}

function follow() {
  const moved = box.scrollTop - scrolled;
  scrolled += moved;
  if (moved) down = moved > 0;
  if (hidden() <= bar()) top = scrolled;
  else followShare(moved);
  render();
  clearTimeout(due);
  if (Math.abs(moved) < FAST * grid.sight) askForSight();
  else due = setTimeout(askForSight, STILL);
}

/** Of a wall taller than its bar: a wheel moves it by as much as the page; who drags the bar means a place of the whole. */
function followShare(moved) {
  if (Math.abs(moved) > 2 * grid.sight) top = Math.round((scrolled / bar()) * hidden());
  else top = Math.max(0, Math.min(hidden(), top + moved));
  const end = scrolled <= 0 ? 0 : scrolled >= bar() - 1 ? hidden() : NaN;
  if (Math.abs(top - end) < grid.sight) top = end;
  else if (!Number.isNaN(end)) putBarRight(); // the bar is at its end before the wall is
}

/** When one has come to rest, since a scroll bar that is put right ends what the browser is still moving. */
function settle() {
  putBarRight();
  render();
}

function inSight() {
  const first = Math.max(0, Math.floor(top / grid.row) - 1) * grid.columns;
  const last = Math.min(total, (Math.ceil((top + grid.sight) / grid.row) + 1) * grid.columns);
  return [first, last];
}

function make(row) {
  if (!row) return { node: waiting(), redraw: () => {} };
  if (!row.problem) return card(row, all, roomOf);
  const words = el("span", { class: "missing" }, "cannot be read");
  return { node: el("div", { class: "card", "data-frame": row.index, title: row.problem },
    el("span", { class: "picture" }, words), el("span", { class: "title" }, `Frame ${row.index}`), el("span", { class: "about bad" }, row.problem)),
    redraw: () => {} };
}

const waiting = () => el("div", { class: "card waiting", "aria-hidden": "true" },
  el("span", { class: "picture" }), el("span", { class: "title" }, " "), el("span", { class: "about" }, " "));

/** Make the cards in sight, a few at a time, and put them in their places. */
function render() {
  cancelAnimationFrame(painting);
  const [first, last] = inSight();
  const wanted = new Map();
  const fresh = [];
  let left = AT_ONCE;
  for (let place = first; place < last; place++) {
    const row = rowAt(place);
    let name = row ? `frame ${row.index}` : `place ${place}`;
    if (!cards.has(name) && left-- <= 0) name = `place ${place}`; // whoever waits there goes on to wait
    let one = cards.get(name);
    if (!one && left < 0) continue;
    if (!one) fresh.push((one = make(row)));
    if (row) row.place = place;
    put(one, place);
    wanted.set(name, one);
  }
  cards.forEach((one, name) => { if (!wanted.has(name)) remove(one.node); });
  let cursor = space.firstChild;
  wanted.forEach(({ node }) => {
    if (node === cursor) cursor = cursor.nextSibling;
    else space.insertBefore(node, cursor);
  });
  cards = wanted;
  fresh.forEach((one) => one.redraw());
  if (left < 0) painting = requestAnimationFrame(render);
}

function put(one, place) {
  const x = (place % grid.columns) * (grid.width + grid.gap);
  const y = Math.floor(place / grid.columns) * grid.row - top + scrolled;
  if (one.x !== x || one.y !== y) one.node.style.transform = `translate(${x}px, ${y}px)`;
  if (one.place !== place) one.node.dataset.place = place;
  Object.assign(one, { x, y, place });
}

/** Remove a card; a picture that is under way is not waited for. */
function remove(node) {
  node.remove();
  for (const image of node.querySelectorAll("img")) if (!image.complete) image.removeAttribute("src");
}

/** Ask for the rows in sight, and once they are there for those that come next. */
function askForSight() {
  clearTimeout(due);
  if (!total) return;
  const [first, last] = inSight();
  const [from, to] = [Math.floor(first / PIECE), Math.floor((last - 1) / PIECE)];
  for (const [number, one] of pieces) {
    if (!one.rows && (number < from - 1 || number > to + 1)) {
      one.stop.abort();
      pieces.delete(number);
    } else if (pieces.size > HELD && (number < from - 4 || number > to + 4)) pieces.delete(number);
  }
  let isThere = true;
  for (let number = from; number <= to; number++) {
    piece(number);
    isThere &&= Boolean(pieces.get(number).rows);
  }
  const next = down ? to + 1 : from - 1;
  if (isThere && top > 0 && next >= 0 && next * PIECE < total) piece(next);
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
  }, () => { if (own.get(number) === one) own.delete(number); });
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
  const ends = { Home: 0, End: hidden() };
  if (event.key in ends) {
    event.preventDefault();
    goTo(ends[event.key]);
    return;
  }
  const moves = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -grid.columns, ArrowDown: grid.columns };
  const at = Number(document.activeElement.closest?.(".card")?.dataset.place ?? NaN);
  const to = at + moves[event.key];
  if (!(to >= 0 && to < total)) return;
  event.preventDefault();
  bringIntoSight(to);
  space.querySelector(`[data-place="${to}"]`)?.focus({ preventScroll: true });
}

export function showWall() {
  box.classList.add("endless");
  box.tabIndex = 0;
  box.setAttribute("aria-label", "Pictures; scroll for more");
  box.append(space);
  box.addEventListener("scroll", follow, { passive: true });
  box.addEventListener("scrollend", settle);
  box.addEventListener("keydown", keys);
  subscribe("layers", redraw);
  document.addEventListener("themechange", redraw);
  onLayout(box, layOut);
  addEventListener("resize", layOut); // the wall is as tall as the window lets it
}
