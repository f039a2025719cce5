// What the page shows, and the names that its numbers stand for.

import { byId } from "report/dom.js";

export const data = JSON.parse(byId("data").textContent);
export const { facts, summary, shown, models, proof, box, sequences, keys } = data;

let categories = null;

/** Put newer counts in the place of the old ones; those who show them are told by the caller. */
export function renew(counts) {
  Object.assign(summary, counts);
  categories = new Map(summary.categories.map((category) => [category.id, category]));
}

renew({});

export const categoryName = (id) => categories.get(id)?.name ?? `category ${id}`;

/** The style property that holds a category's colour: the same everywhere on the page. */
export function categoryToken(id) {
  const hue = categories.get(id)?.hue ?? -1;
  return hue < 0 ? "--hue-other" : `--hue-${hue}`;
}

/** What to call a frame's subject: its first object's model, else its category. */
export function subject(frame) {
  const first = frame.objects[0];
  if (!first) return "no objects";
  const others = frame.objects.length > 1 ? ` and ${frame.objects.length - 1} more` : "";
  return `${first.model || categoryName(first.category)}${others}`;
}

export const poseName = (name) => name || "unknown";

/** Width and height of a frame in pixels. */
export const frameSize = (frame) => ({ width: frame.size[0], height: frame.size[1] });
