// Puts the page together.

import { facts, summary } from "report/data.js";
import { byId, count, el, plural } from "report/dom.js";
import { showDistributions } from "report/charts.js";
import { showPlayer } from "report/player.js";
import { showGallery } from "report/gallery.js";
import { showModels } from "report/models.js";
import { showProvenance, verdict } from "report/provenance.js";
import { showSphere } from "report/sphere.js";

const THEMES = { "": "Theme: automatic", light: "Theme: light", dark: "Theme: dark" };

const figure = (n, one, many = `${one}s`) => [n === 1 ? one : many, count(n)];

function overview() {
  const sizes = summary.sizes.map(([w, h]) => `${w} × ${h}`).join(", ");
  const figures = [
    figure(summary.frames, "frame"),
    figure(summary.objects, "object"),
    figure(summary.models.length, "model"),
    ...(summary.sequences ? [figure(summary.sequences, "sequence")] : []),
    figure(summary.categories.length, "category", "categories"),
    ["pixels", sizes],
  ].filter(([, value]) => value);
  const unseen = summary.empty ? ` In ${plural(summary.empty, "frame")} no object is seen.` : "";
  const made = summary.models.length ? `${plural(summary.models.length, "model")} in ${plural(facts.poses, "pose")}` : "pictures made elsewhere";
  byId("overview").append(
    el("h1", {}, facts.name),
    el("p", { class: "lead" }, `A data set of ${plural(summary.frames, "frame")}: ${made}, made by viewsphere ${facts.madeBy}.${unseen}`),
    verdict(),
    el("dl", { class: "figures" }, ...figures.map(([name, value]) => el("div", {}, el("dt", {}, name), el("dd", {}, value)))));
  byId("brand").textContent = facts.name;
}

function theme() {
  const root = document.documentElement;
  const button = byId("theme");
  const order = Object.keys(THEMES);
  const set = (name) => {
    root.dataset.theme = name;
    button.setAttribute("aria-label", THEMES[name]);
    button.replaceChildren("◐", el("span", { class: "words" }, ` ${THEMES[name]}`));
    document.dispatchEvent(new Event("themechange"));
  };
  button.addEventListener("click", () => {
    const next = order[(order.indexOf(root.dataset.theme ?? "") + 1) % order.length];
    try {
      localStorage.setItem("viewsphere-theme", next);
    } catch {
      // Without storage the choice lasts as long as the page.
    }
    set(next);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => document.dispatchEvent(new Event("themechange")));
  set(order.includes(root.dataset.theme) ? root.dataset.theme : "");
}

/** The section that is read is marked among the links. */
function markSection() {
  const links = new Map([...document.querySelectorAll(".bar nav a:not(.brand)")].map((a) => [a.hash.slice(1), a]));
  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      links.forEach((a) => a.removeAttribute("aria-current"));
      links.get(entry.target.id).setAttribute("aria-current", "true");
    }
  }, { rootMargin: "-20% 0px -70% 0px" });
  links.forEach((link, id) => {
    if (!link.hidden) watcher.observe(byId(id));
  });
}

theme();
overview();
showPlayer();
showGallery();
showSphere();
showDistributions();
showModels();
showProvenance();
markSection();
document.documentElement.dataset.ready = "true";
