// A model near by, and the same model among its cameras.

import { box, data, models, shown, summary, categoryName } from "report/data.js";
import { byId, count, decimal, el, plural } from "report/dom.js";
import { openLightbox } from "report/lightbox.js";
import { frustumLines } from "report/scenes/frustum.js";
import { makeStage, onSphere, themeColor } from "report/scenes/stage3d.js";

const {
  BufferAttribute, BufferGeometry, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, Points, PointsMaterial, Raycaster, Vector2,
} = globalThis.viewsphereVendor;

const CREASE = 0.75; // cosine between faces that still look smooth together

const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;

const attribute = (values, width = 3) => new BufferAttribute(values instanceof Float32Array ? values : new Float32Array(values), width);

const linear = (byte) => Math.pow(byte / 255, 2.2);

function unpacked(mesh) {
  const steps = new Uint16Array(bytes(mesh.positions));
  const positions = new Float32Array(steps.length);
  steps.forEach((v, i) => (positions[i] = mesh.low[i % 3] + (v / 65535) * (mesh.high[i % 3] - mesh.low[i % 3])));
  return {
    positions,
    triangles: new Uint32Array(bytes(mesh.triangles)),
    colors: new Uint8Array(bytes(mesh.colors)),
    edges: new Uint32Array(bytes(mesh.edges)),
    edgeColors: new Uint8Array(bytes(mesh.edgeColors)),
  };
}

/** The mesh as three.js objects: its faces, and lines for what is thinner than they are. */
function modelGroup(mesh) {
  const { positions, triangles, colors, edges, edgeColors } = unpacked(mesh);
  const spread = (indices, per, values) => {
    const points = new Float32Array(indices.length * 3);
    const tones = new Float32Array(indices.length * 3);
    indices.forEach((vertex, i) => {
      points.set(positions.subarray(3 * vertex, 3 * vertex + 3), 3 * i);
      const face = 3 * Math.floor(i / per);
      for (let k = 0; k < 3; k++) tones[3 * i + k] = linear(values[face + k]);
    });
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", attribute(points));
    geometry.setAttribute("color", attribute(tones));
    return geometry;
  };
  const faces = spread(triangles, 3, colors);
  faces.setAttribute("normal", attribute(creasedNormals(faces.getAttribute("position").array, triangles)));
  const group = new Group();
  group.add(new Mesh(faces, new MeshLambertMaterial({ vertexColors: true, side: DoubleSide })));
  if (edges.length) group.add(new LineSegments(spread(edges, 2, edgeColors), new LineBasicMaterial({ vertexColors: true })));
  return group;
}

/** A normal for each corner: the mean of the faces around its vertex that are not turned too far away. */
function creasedNormals(points, triangles) {
  const count = triangles.length / 3;
  const face = new Float32Array(triangles.length);
  const around = new Map();
  for (let t = 0; t < count; t++) {
    const [ax, ay, az, bx, by, bz, cx, cy, cz] = points.subarray(9 * t, 9 * t + 9);
    const [ux, uy, uz, vx, vy, vz] = [bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az];
    face.set([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], 3 * t);
    for (let k = 0; k < 3; k++) {
      const vertex = triangles[3 * t + k];
      if (!around.has(vertex)) around.set(vertex, []);
      around.get(vertex).push(t);
    }
  }
  const length = (t) => Math.hypot(face[3 * t], face[3 * t + 1], face[3 * t + 2]) || 1e-20;
  const normals = new Float32Array(points.length);
  for (let corner = 0; corner < triangles.length; corner++) {
    const t = Math.floor(corner / 3);
    const sum = [0, 0, 0];
    for (const other of around.get(triangles[corner])) {
      const dot = face[3 * t] * face[3 * other] + face[3 * t + 1] * face[3 * other + 1] + face[3 * t + 2] * face[3 * other + 2];
      if (dot / (length(t) * length(other)) < CREASE) continue;
      for (let k = 0; k < 3; k++) sum[k] += face[3 * other + k];
    }
    const size = Math.hypot(...sum) || 1;
    for (let k = 0; k < 3; k++) normals[3 * corner + k] = sum[k] / size;
  }
  return normals;
}

function lines(points, name, opacity = 1) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", attribute(points));
  return new LineSegments(geometry, new LineBasicMaterial({ color: themeColor(name), transparent: opacity < 1, opacity }));
}

/** The shown frames' cameras as frustums in the model's axes, each with its frame. */
function frustums(key, size) {
  const found = [];
  for (const frame of shown) {
    for (const object of frame.objects) {
      if (object.model !== key || !object.cameraFromObject || !frame.camera || frame.scan) continue;
      const m = object.cameraFromObject;
      const place = ([x, y, z]) => {
        const d = [x - m[3], y - m[7], z - m[11]];
        return [0, 1, 2].map((k) => m[k] * d[0] + m[4 + k] * d[1] + m[8 + k] * d[2]);
      };
      const apex = place([0, 0, 0]);
      const points = frustumLines(frame, size).flatMap(place);
      found.push({ frame, apex, points });
    }
  }
  return found;
}

function boxLines(low, high) {
  const corners = box.signs.map((signs) => signs.map((sign, k) => (sign > 0 ? high[k] : low[k])));
  return box.edges.flatMap(([a, b]) => [...corners[a], ...corners[b]]);
}

function replace(stage, group) {
  if (stage.shown) {
    stage.scene.remove(stage.shown);
    stage.shown.traverse((node) => {
      node.geometry?.dispose();
      node.material?.dispose();
    });
  }
  stage.shown = group;
  stage.scene.add(group);
}

function showNear(stage, model) {
  const group = modelGroup(model.mesh);
  const { low, high } = model.mesh;
  group.add(lines(boxLines(low, high), "--soft", 0.5));
  replace(stage, group);
  const middle = low.map((v, k) => (v + high[k]) / 2);
  const radius = Math.hypot(...low.map((v, k) => high[k] - v)) / 2;
  const narrow = Math.min(1, stage.camera.aspect);
  stage.lookFrom(middle, 35, 20, (radius / Math.sin((16 * Math.PI) / 180)) * (1.02 / narrow));
}

function showAround(stage, model) {
  const group = modelGroup(model.mesh);
  const far = Math.max(0.1, ...model.cameras.map((c) => c[2] ?? 0));
  stage.frustums = frustums(model.key, far * 0.14);
  group.add(lines(stage.frustums.flatMap((f) => f.points), "--accent"));
  const points = model.cameras.flatMap(([a, e, d]) => onSphere(a, e, d).map((v, k) => v + model.center[k]));
  const cloud = new BufferGeometry();
  cloud.setAttribute("position", attribute(points));
  group.add(new Points(cloud, new PointsMaterial({ color: themeColor("--soft"), size: 2.5, sizeAttenuation: false })));
  replace(stage, group);
  const { middle, radius } = around([...stage.frustums.flatMap((f) => f.apex), ...points, ...model.mesh.low, ...model.mesh.high]);
  stage.lookFrom(middle, 35, 24, (radius * 3.5) / Math.min(1, stage.camera.aspect));
}

/** The middle of the box of points x, y, z, x, ..., and the farthest of them from it. */
function around(values) {
  const axis = (k) => values.filter((_, i) => i % 3 === k);
  const middle = [0, 1, 2].map((k) => (Math.min(...axis(k)) + Math.max(...axis(k))) / 2);
  let radius = 0;
  for (let i = 0; i < values.length; i += 3) radius = Math.max(radius, Math.hypot(...middle.map((m, k) => values[i + k] - m)));
  return { middle, radius };
}

/** The frustum under the pointer, within some pixels of its apex or picture plane. */
function picked(stage, event) {
  const area = stage.canvas.getBoundingClientRect();
  const at = new Vector2(((event.clientX - area.left) / area.width) * 2 - 1, 1 - ((event.clientY - area.top) / area.height) * 2);
  const ray = new Raycaster();
  ray.setFromCamera(at, stage.camera);
  ray.params.Line.threshold = stage.camera.position.distanceTo(stage.controls.target) * 0.008;
  const all = stage.shown.children.filter((node) => node.isLineSegments).pop();
  const hit = ray.intersectObject(all)[0];
  let rest = hit ? hit.index : -1;
  return hit ? stage.frustums.find((f) => (rest -= f.points.length / 3) < 0) : null;
}

function pickFrames(stage, hint) {
  let pressed = null;
  stage.canvas.addEventListener("pointermove", (event) => {
    const found = stage.shown && !event.buttons ? picked(stage, event) : null;
    hint.textContent = found ? `frame ${found.frame.index}` : "";
  });
  stage.canvas.addEventListener("pointerdown", (event) => (pressed = [event.clientX, event.clientY]));
  stage.canvas.addEventListener("click", (event) => {
    const still = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4;
    const found = still && stage.shown ? picked(stage, event) : null;
    if (found) openLightbox(found.frame, stage.frustums.map((f) => f.frame));
  });
}

const summaryOf = (key) => summary.models.find((model) => model.key === key);

function facts(model) {
  const info = summaryOf(model.key);
  const [width, height, length] = info.size;
  const kept = model.mesh ? Math.round((model.mesh.triangles.length * 3) / 4 / 12) : 0;
  const shownAs = kept && kept < info.triangles ? `, simplified here to ${count(kept)}` : "";
  return `${model.key}: ${categoryName(info.category)}, ${decimal(width)} × ${decimal(height)} × ${decimal(length)} m (width, height, length), ` +
    `${plural(info.triangles, "triangle")}${shownAs}, ${plural(info.parts, "part")}, ${plural(model.views, "view")}` +
    (model.problem ? `. ${model.problem}` : ".");
}

export function showModels() {
  const usable = data.live ? summary.models : models.filter((model) => model.mesh);
  if (!usable.length) {
    byId("model-pair").append(el("p", { class: "lead" }, models[0]?.problem ?? "This data set brings no models."));
    return;
  }
  const near = el("div", { class: "stage" });
  const wide = el("div", { class: "stage" });
  const hint = el("div", { class: "hint", "aria-hidden": "true" });
  byId("model-pair").append(
    el("figure", {}, near, el("figcaption", {}, "The model in its box. Drag to turn.")),
    el("figure", {}, wide, el("figcaption", {}, `Its cameras: dots are viewpoints, frustums ${data.live ? "some pictures" : "the pictures shown above"}; select one to enlarge it.`)));
  const stages = [makeStage(near, "The model in 3D"), makeStage(wide, "The model among its cameras, in 3D")];
  if (!stages[0] || !stages[1]) return;
  wide.append(hint);
  pickFrames(stages[1], hint);
  const show = async () => {
    const chosen = usable.find((m) => m.key === select.value);
    const model = data.live ? await data.live.model(chosen.key) : chosen;
    if (chosen.key !== select.value) return; // another was chosen meanwhile
    byId("model-facts").textContent = model ? facts(model) : "This model cannot be read now.";
    if (!model?.mesh) return;
    showNear(stages[0], model);
    showAround(stages[1], model);
  };
  const select = el("select", { name: "shown-model", onchange: show }, ...usable.map((m) => el("option", { value: m.key }, m.key)));
  const step = (change) => () => {
    select.selectedIndex = (select.selectedIndex + change + usable.length) % usable.length;
    show();
  };
  const some = usable.length < summary.models.length ? ` (${usable.length} of ${count(summary.models.length)})` : "";
  byId("model-choice").append(
    el("label", {}, `Model${some}`, select),
    el("button", { type: "button", "aria-label": "Previous model", onclick: step(-1) }, "←"),
    el("button", { type: "button", "aria-label": "Next model", onclick: step(1) }, "→"));
  document.addEventListener("themechange", show);
  requestAnimationFrame(() => requestAnimationFrame(show)); // when the canvases have their sizes
}
