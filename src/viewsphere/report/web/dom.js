// Elements and numbers. Text goes in as text nodes only, so nothing in a data set can become markup.

const SVG = "http://www.w3.org/2000/svg";

export const byId = (id) => document.getElementById(id);

function filled(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

/** An HTML element; attributes named on... are listeners. */
export const el = (tag, attributes = {}, ...children) => filled(document.createElement(tag), attributes, children);

/** An SVG element. */
export const svg = (tag, attributes = {}, ...children) => filled(document.createElementNS(SVG, tag), attributes, children);

export const count = (n) => n.toLocaleString("en-US");

export const plural = (n, one, many = `${one}s`) => `${count(n)} ${n === 1 ? one : many}`;

/** A number with at most so many decimals; a dash for none. */
export const decimal = (value, digits = 2) =>
  value === null || value === undefined ? "–" : String(Number(value.toFixed(digits))).replace("-", "−");

export const percent = (value) => {
  if (value === null || value === undefined) return "–";
  const shown = value * 100;
  // A share is not whole before it is 1, nor nothing before it is 0.
  if (value < 1 && shown > 99.9) return "99.9 %";
  if (value > 0 && shown < 0.1) return "0.1 %";
  return `${Number(shown.toFixed(1))} %`;
};

export const degrees = (value) => (value === null || value === undefined ? "–" : `${decimal(value, 1)}°`);

export function table(rows, attributes = {}) {
  return el("table", attributes, el("tbody", {}, ...rows.map(([name, ...cells]) =>
    el("tr", {}, el("th", { scope: "row" }, name), ...cells.map((cell) => (cell instanceof Element && cell.tagName === "TD" ? cell : el("td", {}, cell)))))));
}

/** Named counts as bars; rows are {name, count, label, color, choose}: `choose` makes the name a button. */
export function bars(rows, unit) {
  const most = Math.max(1, ...rows.map((row) => row.count));
  return el("div", { class: "bars", role: "list" }, ...rows.flatMap((row) => {
    const swatch = row.color ? el("i", { class: "swatch", style: `background:${row.color}` }) : null;
    const name = row.choose
      ? el("button", { type: "button", class: "link", title: `Show pictures: ${row.name}`, onclick: row.choose }, swatch, row.name)
      : el("span", {}, swatch, row.name);
    return [
      el("div", { class: "name", role: "listitem", "aria-label": `${row.name}: ${plural(row.count, unit)}` }, name),
      el("div", { class: "track", "aria-hidden": "true" },
        el("i", { style: `width:${(100 * row.count) / most}%${row.color ? `;background:${row.color}` : ""}` })),
      el("div", { class: "count" }, row.label ?? count(row.count)),
    ];
  }));
}

const tokens = new Map();
document.addEventListener("themechange", () => tokens.clear());

/** The value of a style property of the page, such as --ink; to ask the browser for it costs a layout of what is new on the page. */
export function token(name) {
  if (!tokens.has(name)) tokens.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return tokens.get(name);
}

const channels = (name) => {
  const value = parseInt(token(name).slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
};

/** The colour of a share between 0 and 1 on the page's ramp of counts, "rgb(r g b)". */
export function ramp(share) {
  const [low, high] = [channels("--ramp-low"), channels("--ramp-high")];
  return `rgb(${low.map((v, i) => Math.round(v + share * (high[i] - v))).join(", ")})`;
}

/** Calls back, at once and later, when the element's width or the theme changes; draws no more often than frames are shown. */
export function onLayout(element, draw) {
  let width = 0;
  let due = 0;
  const soon = () => {
    cancelAnimationFrame(due);
    due = requestAnimationFrame(draw);
  };
  new ResizeObserver(() => {
    if (element.clientWidth === width) return;
    width = element.clientWidth;
    soon();
  }).observe(element);
  document.addEventListener("themechange", function changed() {
    if (element.isConnected) soon();
    else document.removeEventListener("themechange", changed);
  });
}
