// The rig of a sequence among its objects: the frusta of its sensors at an instant, and the way it goes.

import { box, categoryToken } from "report/data.js";
import { frustumLines } from "report/scenes/frustum.js";
import { makeStage, themeColor } from "report/scenes/stage3d.js";

const { BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments } = globalThis.viewsphereVendor;

function lines(points, tone, opacity = 1) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: themeColor(tone), transparent: opacity < 1, opacity }));
}

const center = (frame) => [3, 7, 11].map((i) => frame.worldFromCamera[i]);

/** The lines of a camera's frustum in world axes. */
function frustum(frame, size) {
  const m = frame.worldFromCamera;
  return frustumLines(frame, size).flatMap((p) => [0, 4, 8].map((row) => m[row] * p[0] + m[row + 1] * p[1] + m[row + 2] * p[2] + m[row + 3]));
}

const edgesOf = (corners) => box.edges.flatMap(([a, b]) => [...corners.slice(3 * a, 3 * a + 3), ...corners.slice(3 * b, 3 * b + 3)]);

function bounds(values) {
  const axis = (k) => values.filter((_, i) => i % 3 === k);
  const [low, high] = [Math.min, Math.max].map((pick) => [0, 1, 2].map((k) => axis(k).reduce((a, b) => pick(a, b))));
  return { middle: low.map((v, k) => (v + high[k]) / 2), radius: Math.hypot(...low.map((v, k) => high[k] - v)) / 2 };
}

function dispose(group) {
  group.traverse((node) => {
    node.geometry?.dispose();
    node.material?.dispose();
  });
}

/** A stage with `choose(frames of all instants)` and `show(frames of one)`; null where the browser has no WebGL. */
export function showRig(holder, caption) {
  const stage = makeStage(holder, "The rig among the objects, in 3D");
  if (!stage) return null;
  let group = new Group();
  let path = [];
  let size = 1;
  let now = [];
  const show = (frames) => {
    now = frames;
    stage.scene.remove(group);
    dispose(group);
    group = new Group();
    const known = frames.filter((frame) => frame.worldFromCamera && frame.camera);
    group.add(lines(path, "--soft", 0.7));
    known.forEach((frame) => group.add(lines(frustum(frame, size), "--ink")));
    frames[0].boxes.forEach((corners, i) => corners && group.add(lines(edgesOf(corners), categoryToken(frames[0].objects[i].category))));
    stage.scene.add(group);
    stage.redraw();
  };
  const choose = (instants) => {
    const places = instants.map((frames) => frames[0]).filter((frame) => frame.worldFromCamera).map(center);
    path = places.slice(1).flatMap((p, i) => [...places[i], ...p]);
    const corners = instants.flatMap((frames) => frames[0].boxes.filter(Boolean)).flat();
    const { middle, radius } = bounds([...places.flat(), ...corners]);
    size = Math.max(0.3, radius * 0.18);
    stage.lookFrom(middle, 35, 30, Math.max(0.5, radius * 3) / Math.min(1, stage.camera.aspect));
    const many = instants[0].length > 1 ? `The rig's ${instants[0].length} sensors` : "The camera";
    caption.textContent = `${many} at the instant above, the way, and the boxes of the objects. Drag to turn.`;
  };
  document.addEventListener("themechange", () => now.length && show(now));
  return { show, choose };
}
