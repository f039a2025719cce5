// What every page of a data set has around its sections: the choice of a theme, and the links on top.

import { byId, count, el } from "report/dom.js";

const THEMES = { "": "Theme: automatic", light: "Theme: light", dark: "Theme: dark" };

/** A term and its number, for a list of figures. */
export const figure = (n, one, many = `${one}s`) => [n === 1 ? one : many, count(n)];

/** The list of those figures that have a value. */
export const figureList = (figures) =>
  el("dl", { class: "figures" }, ...figures.filter(([, value]) => value).map(([name, value]) => el("div", {}, el("dt", {}, name), el("dd", {}, value))));

export function theme() {
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
export function markSection() {
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
