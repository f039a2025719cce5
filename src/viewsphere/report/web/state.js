// What is drawn over the pictures and which of them are shown; those who show it subscribe.

export const LAYERS = [
  { name: "boxes", label: "2D boxes", key: "b" },
  { name: "boxes3d", label: "3D boxes", key: "x" },
  { name: "masks", label: "Masks", key: "m" },
  { name: "depth", label: "Depth", key: "d", surface: true },
  { name: "normals", label: "Normals", key: "n", surface: true },
  { name: "coordinates", label: "Coordinates", key: "c", surface: true },
  { name: "nocs", label: "NOCS", key: "k", surface: true },
  { name: "position", label: "Position", key: "w", surface: true },
  { name: "semantic", label: "Semantic", key: "e", surface: true },
  { name: "panoptic", label: "Panoptic", key: "a", surface: true },
  { name: "parts", label: "Parts", key: "p", surface: true },
  { name: "materials", label: "Materials", key: "l", surface: true },
  { name: "body_parts", label: "Body parts", key: "y", surface: true },
  { name: "flow", label: "Flow", key: "f", surface: true },
  { name: "flow_state", label: "Seen next", key: "s", surface: true },
  { name: "disparity", label: "Disparity", key: "i", surface: true },
  { name: "motion_boundaries", label: "Motion boundaries", key: "o", surface: true },
  { name: "albedo", label: "Albedo", key: "a", surface: true },
  { name: "shading", label: "Shading", key: "h", surface: true },
  { name: "residual", label: "Other light", key: "l", surface: true },
  { name: "emission", label: "Emission", key: "e", surface: true },
  { name: "roughness", label: "Roughness", key: "r", surface: true },
  { name: "metallic", label: "Metal", key: "k", surface: true },
  { name: "tracks", label: "Tracks", key: "t" },
];

export const layers = new Set(["boxes"]);

export const EVERYTHING = { category: "", model: "", split: "", pose: "", low: 0, high: 1, cell: null, order: "mixed" };

export const filter = { ...EVERYTHING };

const listeners = { layers: [], filter: [], summary: [] };

export const subscribe = (kind, listener) => listeners[kind].push(listener);

export const tell = (kind) => listeners[kind].forEach((listener) => listener());

/** Layers that cover the surface exclude one another; drawings go over any of them. */
export function toggleLayer(name) {
  const wanted = !layers.has(name);
  if (LAYERS.find((layer) => layer.name === name).surface) {
    for (const layer of LAYERS) if (layer.surface) layers.delete(layer.name);
  }
  if (wanted) layers.add(name);
  else layers.delete(name);
  tell("layers");
}

export function setFilter(changes) {
  Object.assign(filter, changes);
  tell("filter");
}

const inCell = (cell, azimuth, elevation) =>
  (((azimuth - cell.azimuth[0]) % 360) + 360) % 360 < cell.azimuth[1] - cell.azimuth[0] &&
  elevation >= cell.elevation[0] && (elevation < cell.elevation[1] || cell.elevation[1] >= 90);

function objectMatches(object) {
  if (filter.category && String(object.category) !== filter.category) return false;
  if (filter.model && object.model !== filter.model) return false;
  if (filter.pose && (object.pose || "unknown") !== filter.pose) return false;
  if (filter.cell?.of === "views" && !(object.view && inCell(filter.cell, object.view[0], object.view[1]))) return false;
  if (filter.low === 0 && filter.high === 1) return true;
  return object.visibility !== null && object.visibility >= filter.low && object.visibility <= filter.high;
}

const objectsMatter = () =>
  filter.category || filter.model || filter.pose || filter.low > 0 || filter.high < 1 || filter.cell?.of === "views";

/** Whether the frame is shown: its split and camera, and one object that meets all that is asked of objects. */
export function matches(frame) {
  if (filter.split && frame.split !== filter.split) return false;
  if (filter.cell?.of === "cameras" && !(frame.pose && inCell(filter.cell, frame.pose.azimuth, frame.pose.elevation))) return false;
  return !objectsMatter() || frame.objects.some(objectMatches);
}
