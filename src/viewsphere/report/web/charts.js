// Distributions over all frames, with Observable Plot.

import { categoryToken, summary } from "report/data.js";
import { bars, byId, count, decimal, el, onLayout, percent, plural } from "report/dom.js";
import { setFilter } from "report/state.js";

const { plot, pointerX, rectY, ruleX, ruleY, tip } = globalThis.viewsphereVendor;

const SIZES = [[32, "small < 32²"], [96, "medium < 96²"]];

/** Counts between edges, a series for each colour, one upon the other. */
export function histogram(figure, { edges, series, tokens, names, unit, what, share = false, marks = [] }) {
  const rows = series.flatMap((counts, s) => counts.map((n, i) => ({ x1: edges[i], x2: edges[i + 1], n, series: names[s] })));
  const totals = edges.slice(1).map((x2, i) => ({ x1: edges[i], x2, n: series.reduce((sum, counts) => sum + counts[i], 0) }));
  const value = (v) => (share ? percent(v) : `${decimal(v, 3)} ${unit}`);
  const holder = el("div");
  figure.append(holder);
  onLayout(figure, () => {
    const chart = plot({
      width: Math.max(260, figure.clientWidth),
      height: 220,
      marginLeft: 48,
      marginBottom: 38,
      x: { label: null, domain: [edges[0], edges[edges.length - 1]], ...(share ? { tickFormat: (v) => `${Math.round(v * 100)} %` } : {}), ticks: figure.clientWidth < 420 ? 5 : 8 },
      y: { label: null, grid: true, ticks: 4, tickFormat: (v) => (Number.isInteger(v) ? count(v) : "") },
      color: { domain: names, range: tokens.map((name) => `var(${name})`) },
      style: { background: "transparent", color: "var(--ink)", fontFamily: "inherit" },
      marks: [
        rectY(rows, { x1: "x1", x2: "x2", y: "n", fill: "series", inset: 0.5 }),
        ruleY([0], { stroke: "var(--soft)" }),
        ruleX(marks.filter(([x]) => x > edges[0] && x < edges[edges.length - 1]), { x: (m) => m[0], stroke: "var(--soft)", strokeDasharray: "3 3" }),
        tip(totals, pointerX({ x1: "x1", x2: "x2", y: "n", fill: "var(--card)", stroke: "var(--line)", textPadding: 6,
          title: (d) => `${value(d.x1)} to ${value(d.x2)}\n${plural(d.n, what)}` })),
      ],
    });
    chart.setAttribute("role", "img");
    chart.setAttribute("aria-label", described(totals, value, what));
    holder.replaceChildren(chart);
  });
}

function described(totals, value, what) {
  const most = totals.reduce((best, bin) => (bin.n > best.n ? bin : best), totals[0]);
  return `Histogram of ${plural(totals.reduce((sum, bin) => sum + bin.n, 0), what)}; most, ${count(most.n)}, from ${value(most.x1)} to ${value(most.x2)}`;
}

/** Series in the categories' colours; those that share the grey become one. */
function colored(distribution) {
  const groups = new Map();
  summary.categories.forEach((category, i) => {
    const name = categoryToken(category.id);
    const group = groups.get(name) ?? { name: name === "--hue-other" ? "others" : category.name, counts: distribution.series[i].map(() => 0) };
    group.counts = group.counts.map((n, k) => n + distribution.series[i][k]);
    groups.set(name, group);
  });
  return { tokens: [...groups.keys()], names: [...groups.values()].map((g) => g.name), series: [...groups.values()].map((g) => g.counts) };
}

function distributionFigure(distribution) {
  const median = distribution.share ? percent(distribution.median) : `${decimal(distribution.median, 2)} ${distribution.name === "side" ? "px" : "m"}`;
  const marks = distribution.name === "side" ? SIZES : [];
  const heights = marks.length ? ` Dashed: COCO's limits of small (32 px) and medium (96 px).` : "";
  const figure = el("figure", {}, el("h3", {}, distribution.title));
  histogram(figure, { ...colored(distribution), edges: distribution.edges, unit: distribution.name === "side" ? "px" : "m", what: "object", share: distribution.share, marks });
  figure.append(el("figcaption", {}, `${distribution.unit}; median ${median}.${heights}`));
  return figure;
}

function legend() {
  if (summary.categories.length < 2) return null;
  const named = summary.categories.filter((c) => c.hue >= 0);
  const items = named.map((c) => el("span", {}, el("i", { class: "swatch", style: `background:var(--hue-${c.hue})` }), c.name));
  if (named.length < summary.categories.length) items.push(el("span", {}, el("i", { class: "swatch", style: "background:var(--hue-other)" }), "others"));
  return el("p", { class: "legend", style: "grid-column:1/-1" }, ...items);
}

function shareLists() {
  const jump = (changes) => () => {
    setFilter(changes);
    byId("pictures").scrollIntoView();
  };
  const total = Math.max(1, summary.frames);
  const categories = summary.categories.map((c) => ({
    name: c.name, count: c.objects, color: `var(${categoryToken(c.id)})`, choose: jump({ category: String(c.id) }),
    label: c.seen === c.objects ? count(c.objects) : `${count(c.objects)}, ${count(c.seen)} seen`,
  }));
  const splits = summary.splits.map((s) => ({
    name: s.name, count: s.frames, label: `${count(s.frames)} (${percent(s.frames / total)})`, choose: jump({ split: s.name }),
  }));
  byId("shares").replaceChildren(
    el("figure", {}, el("h3", {}, "Categories, objects"), bars(categories, "object")),
    el("figure", {}, el("h3", {}, "Splits, frames"), bars(splits, "frame")));
}

export function showDistributions() {
  byId("distributions-lead").textContent = `Counted over all ${plural(summary.frames, "frame")} and ${plural(summary.objects, "object")}, not only those shown above.`;
  shareLists();
  const known = summary.distributions.filter((d) => d.known);
  byId("histograms").replaceChildren(...[legend(), ...known.map(distributionFigure)].filter(Boolean));
}
