// The sphere of viewpoints: a globe to turn and the same cells as a map; a cell shows its pictures.

import { data, poseName, shown, summary } from "report/data.js";
import { bars, byId, count, decimal, degrees, el, onLayout, plural, ramp, svg } from "report/dom.js";
import { histogram } from "report/charts.js";
import { makeStage, onSphere, themeColor } from "report/scenes/stage3d.js";
import { setFilter, subscribe } from "report/state.js";

const { BufferAttribute, BufferGeometry, Color, DoubleSide, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, Raycaster, SphereGeometry, Vector2 } = globalThis.viewsphereVendor;

const SIDES = [["front", 0], ["front-left", 45], ["left", 90], ["back-left", 135], ["back", 180], ["back-right", 225], ["right", 270], ["front-right", 315]];
const MIDDLE = { cameras: "frame", views: "object" };

let of = "cameras";

/** Cells with edges in degrees, azimuth from 0 to 360 and more where a cell holds 0. */
function cells() {
  const { azimuth: [first, width], elevation: [low, height], occupied } = summary[of];
  return occupied.map(([column, row, number]) => {
    const start = (((first + column * width) % 360) + 360) % 360;
    return {
      azimuth: [start, start + width],
      elevation: [Math.max(-90, low + row * height), Math.min(90, low + (row + 1) * height)],
      number,
    };
  });
}

const label = (cell) => `azimuth ${degrees(cell.azimuth[0])} to ${degrees(cell.azimuth[1] % 360)}, elevation ${degrees(cell.elevation[0])} to ${degrees(cell.elevation[1])}`;

const described = (cell) => `${label(cell)}: ${plural(cell.number, MIDDLE[of])}`;

function choose(cell) {
  setFilter({ cell: { ...cell, of, label: label(cell) } });
  byId("pictures").scrollIntoView();
}

/** 0 to 1 between the least and the most frequent cell. */
function shares(list) {
  const numbers = list.map((cell) => cell.number);
  const [low, high] = [Math.min(...numbers), Math.max(...numbers)];
  return (cell) => (high === low ? 0.75 : (cell.number - low) / (high - low));
}

function globe(holder) {
  const hint = el("div", { class: "hint", "aria-hidden": "true" });
  const stage = makeStage(holder, "Sphere of viewpoints, to be turned with the mouse or the arrow keys");
  if (!stage) return () => {};
  holder.append(hint);
  let patches = null;
  let rest = [];
  const build = () => {
    stage.scene.remove(patches, ...rest);
    patches = new Mesh(patchGeometry(cells()), new MeshBasicMaterial({ vertexColors: true, side: DoubleSide }));
    const ball = new Mesh(new SphereGeometry(0.985, 64, 32), new MeshBasicMaterial({ color: themeColor("--card") }));
    rest = [ball, graticule()];
    stage.scene.add(patches, ...rest);
    stage.redraw();
  };
  for (const [name, azimuth] of SIDES) if (azimuth % 90 === 0) stage.tag(name, onSphere(azimuth, 0, 1.16));
  stage.tag("top", [0, 0, 1.14]);
  stage.lookFrom([0, 0, 0], 35, 25, 4.6);
  const picked = (event) => {
    const area = stage.canvas.getBoundingClientRect();
    const at = new Vector2(((event.clientX - area.left) / area.width) * 2 - 1, 1 - ((event.clientY - area.top) / area.height) * 2);
    const ray = new Raycaster();
    ray.setFromCamera(at, stage.camera);
    const hit = ray.intersectObject(patches)[0];
    return hit ? patches.geometry.userData.cellOf(hit.faceIndex) : null;
  };
  let pressed = null;
  stage.canvas.addEventListener("pointermove", (event) => {
    const cell = event.buttons ? null : picked(event);
    hint.textContent = cell ? described(cell) : "";
  });
  stage.canvas.addEventListener("pointerleave", () => (hint.textContent = ""));
  stage.canvas.addEventListener("pointerdown", (event) => (pressed = [event.clientX, event.clientY]));
  stage.canvas.addEventListener("click", (event) => {
    const still = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4;
    const cell = still ? picked(event) : null;
    if (cell) choose(cell);
  });
  return build;
}

/** Cells as patches of the unit sphere, each cut fine enough to look round, with a narrow gap between them. */
function patchGeometry(list) {
  const share = shares(list);
  const positions = [];
  const colors = [];
  const owners = [];
  for (const cell of list) {
    const color = new Color(ramp(share(cell)));
    const gap = 0.06 * Math.min(cell.azimuth[1] - cell.azimuth[0], cell.elevation[1] - cell.elevation[0]);
    const across = steps(cell.azimuth, gap);
    const up = steps(cell.elevation, gap);
    for (let i = 1; i < across.length; i++) {
      for (let j = 1; j < up.length; j++) {
        const corner = (a, e) => onSphere(across[a], up[e], 1);
        for (const point of [corner(i - 1, j - 1), corner(i, j - 1), corner(i, j), corner(i - 1, j - 1), corner(i, j), corner(i - 1, j)]) {
          positions.push(...point);
          colors.push(color.r, color.g, color.b);
        }
        owners.push(cell, cell);
      }
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute("color", new BufferAttribute(new Float32Array(colors), 3));
  geometry.userData.cellOf = (face) => owners[face];
  return geometry;
}

function steps([start, stop], gap) {
  const pieces = Math.max(1, Math.ceil((stop - start) / 5));
  return Array.from({ length: pieces + 1 }, (_, i) => start + gap + ((stop - start - 2 * gap) * i) / pieces);
}

function graticule() {
  const points = [];
  const arc = (at) => { for (let i = 0; i < 72; i++) points.push(...at(i * 5), ...at(i * 5 + 5)); };
  for (const elevation of [-60, -30, 0, 30, 60]) arc((d) => onSphere(d, elevation, 0.995));
  for (let azimuth = 0; azimuth < 180; azimuth += 45) arc((d) => onSphere(azimuth, d, 0.995));
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: themeColor("--soft"), transparent: true, opacity: 0.35 }));
}

/** The map: azimuth to the right, elevation upwards. */
function map(holder) {
  const list = cells();
  const share = shares(list);
  const width = Math.max(280, holder.clientWidth);
  const edges = list.flatMap((cell) => cell.elevation);
  const [low, high] = [Math.min(0, ...edges), Math.max(30, ...edges)];
  const pad = { left: 34, right: 8, top: 8, bottom: 36 };
  const inner = width - pad.left - pad.right;
  const height = Math.min(360, Math.max(150, (inner / 360) * (high - low) * 1.6));
  const x = (a) => pad.left + (a / 360) * inner;
  const y = (e) => pad.top + ((high - e) / (high - low)) * height;
  const node = svg("svg", { class: "map", viewBox: `0 0 ${width} ${height + pad.top + pad.bottom}`, role: "img", "aria-label": mapLabel(list) });
  axes(node, { x, y, low, high, inner });
  for (const cell of list) {
    for (const [a0, a1] of unwrapped(cell.azimuth)) {
      const rect = svg("rect", {
        class: "cell", x: x(a0) + 0.5, y: y(cell.elevation[1]) + 0.5, width: Math.max(1, x(a1) - x(a0) - 1),
        height: Math.max(1, y(cell.elevation[0]) - y(cell.elevation[1]) - 1), rx: 1.5, fill: ramp(share(cell)), onclick: () => choose(cell),
      }, svg("title", {}, described(cell)));
      node.append(rect);
    }
  }
  holder.replaceChildren(node, key(list));
}

const unwrapped = ([start, stop]) => (stop <= 360 ? [[start, stop]] : [[start, 360], [0, stop - 360]]);

function axes(node, { x, y, low, high, inner }) {
  const text = (at, words, attributes) => node.append(svg("text", { ...at, ...attributes }, words));
  for (let e = Math.ceil(low / 30) * 30; e <= high; e += 30) {
    node.append(svg("line", { class: "grid-line", x1: x(0), x2: x(360), y1: y(e), y2: y(e) }));
    text({ x: x(0) - 5, y: y(e) + 4 }, `${decimal(e)}°`, { "text-anchor": "end" });
  }
  for (const [name, azimuth] of [...SIDES, ["front", 360]]) {
    if (azimuth % 90 && inner < 520) continue;
    const anchor = azimuth === 0 ? "start" : azimuth === 360 ? "end" : "middle";
    node.append(svg("line", { class: "grid-line", x1: x(azimuth), x2: x(azimuth), y1: y(high), y2: y(low) + 4 }));
    text({ x: x(azimuth), y: y(low) + 17 }, `${azimuth}°`, { "text-anchor": anchor });
    text({ x: x(azimuth), y: y(low) + 31 }, name, { "text-anchor": anchor });
  }
}

function mapLabel(list) {
  const numbers = list.map((cell) => cell.number);
  return `Map of viewpoints: ${plural(list.length, "cell")} of azimuth and elevation with ${Math.min(...numbers)} to ${plural(Math.max(...numbers), MIDDLE[of])} each`;
}

function key(list) {
  const numbers = list.map((cell) => cell.number);
  const [low, high] = [Math.min(...numbers), Math.max(...numbers)];
  if (low === high) return el("p", { class: "ramp" }, `${plural(low, MIDDLE[of])} in each of ${plural(list.length, "cell")}`);
  return el("p", { class: "ramp" }, count(low), el("i"), `${plural(high, MIDDLE[of])} in a cell`);
}

function ofChoice(rebuild) {
  const same = JSON.stringify(summary.cameras) === JSON.stringify(summary.views);
  if (same || !summary.cameras.occupied.length || !summary.views.occupied.length) return;
  const buttons = [["cameras", "Cameras of the frames"], ["views", "Cameras as each object sees them"]].map(([name, text]) =>
    el("button", { type: "button", "aria-pressed": String(name === of), onclick: () => {
      of = name;
      buttons.forEach((b) => b.setAttribute("aria-pressed", String(b.textContent === text)));
      rebuild();
    } }, text));
  byId("sphere-choice").append(el("div", { class: "layers", role: "group", "aria-label": "Which viewpoints" }, ...buttons));
}

function poseLists(beside) {
  const rows = summary.poses.map((row) => ({
    name: poseName(row.name),
    count: row.objects,
    choose: data.live || shown.some((frame) => frame.objects.some((o) => poseName(o.pose) === row.name))
      ? () => { setFilter({ pose: row.name }); byId("pictures").scrollIntoView(); }
      : null,
  }));
  const distance = el("figure", { class: "charts" }, el("h3", {}, "Distance of the camera from its target"));
  byId("sides").replaceChildren(el("h3", {}, "Sides seen"), bars(rows, "object"));
  beside.querySelector(".charts")?.remove();
  if (summary.distances.counts.length) {
    beside.append(distance);
    histogram(distance, { edges: summary.distances.edges, series: [summary.distances.counts], tokens: ["--plain"], names: ["frames"], unit: "m", what: "frame" });
  }
}

export function showSphere() {
  if (!summary.cameras.occupied.length) of = "views";
  if (!summary[of].occupied.length) {
    byId("viewpoints-lead").textContent = "No frame of this data set has a known camera.";
    return;
  }
  byId("viewpoints-lead").textContent =
    "All frames, counted in cells of azimuth and elevation: at azimuth 0° the camera looks an object in the face. Select a cell to see its pictures.";
  const holder = el("div", { class: "stage" });
  const flat = el("div", {});
  const beside = el("div", { class: "beside" }, el("figure", {}, flat));
  byId("sphere-pair").append(
    el("figure", {}, holder, el("figcaption", {}, "Drag to turn; arrow keys when focused.")),
    beside);
  const build = globe(holder);
  const rebuild = () => {
    build();
    map(flat);
  };
  ofChoice(rebuild);
  onLayout(flat, rebuild);
  poseLists(beside);
  subscribe("summary", () => {
    rebuild();
    poseLists(beside);
  });
}
