// Puts the page together.

import { facts, summary } from "report/data.js";
import { byId, el, plural } from "report/dom.js";
import { showDistributions } from "report/charts.js";
import { showPlayer } from "report/player.js";
import { showGallery } from "report/gallery.js";
import { showModels } from "report/scenes/models.js";
import { showProvenance, verdict } from "report/provenance.js";
import { figure, figureList, markSection, theme } from "report/shell.js";
import { showSphere } from "report/scenes/sphere.js";

function overview() {
  const sizes = summary.sizes.map(([w, h]) => `${w} × ${h}`).join(", ");
  const figures = [
    figure(summary.frames, "frame"),
    figure(summary.objects, "object"),
    figure(summary.models.length, "model"),
    ...(summary.sequences ? [figure(summary.sequences, "sequence")] : []),
    figure(summary.categories.length, "category", "categories"),
    ["pixels", sizes],
  ];
  const unseen = summary.empty ? ` In ${plural(summary.empty, "frame")} no object is seen.` : "";
  const made = summary.models.length ? `${plural(summary.models.length, "model")} in ${plural(facts.poses, "pose")}` : "pictures made elsewhere";
  byId("overview").append(
    el("h1", {}, facts.name),
    el("p", { class: "lead" }, `A data set of ${plural(summary.frames, "frame")}: ${made}, made by viewsphere ${facts.madeBy}.${unseen}`),
    verdict(),
    figureList(figures));
  byId("brand").textContent = facts.name;
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
