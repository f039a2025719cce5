// A three.js canvas that is drawn only when something changed: turning, size, theme.

import { el, token } from "report/dom.js";

const { Color, DirectionalLight, HemisphereLight, OrbitControls, PerspectiveCamera, Scene, Vector3, WebGLRenderer } = globalThis.viewsphereVendor;

// Pixels drawn across one of the page, at least: browsers without multisampling show smooth edges, too.
const SAMPLES = Math.min(Math.max(window.devicePixelRatio || 1, 2), 3);

export const themeColor = (name) => new Color(token(name));

/** World axes as everywhere in viewsphere: Z up, azimuth 0 looks at the front, which faces -Y. */
export function onSphere(azimuth, elevation, radius) {
  const a = (azimuth * Math.PI) / 180;
  const e = (elevation * Math.PI) / 180;
  return [radius * Math.cos(e) * Math.sin(a), -radius * Math.cos(e) * Math.cos(a), radius * Math.sin(e)];
}

/** A stage in a holder; null, with a word to the user, where the browser has no WebGL. */
export function makeStage(holder, label) {
  const canvas = el("canvas", { role: "img", "aria-label": label, tabindex: 0 });
  let renderer;
  try {
    renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
  } catch {
    holder.append(el("p", { class: "problem" }, "This browser cannot draw in 3D (WebGL is off)."));
    return null;
  }
  holder.append(canvas);
  const scene = new Scene();
  const camera = new PerspectiveCamera(32, 1, 0.01, 1000);
  camera.up.set(0, 0, 1);
  const sun = new DirectionalLight(0xffffff, 2.4);
  sun.position.set(-2, -3, 4);
  scene.add(new HemisphereLight(0xffffff, 0x8d8a84, 2.6), sun);
  const controls = new OrbitControls(camera, canvas);
  controls.enablePan = false;
  controls.listenToKeyEvents(canvas);
  const tags = [];
  let due = 0;
  const render = () => {
    renderer.render(scene, camera);
    placeTags(tags, camera, holder);
  };
  const redraw = () => {
    cancelAnimationFrame(due);
    due = requestAnimationFrame(render);
  };
  controls.addEventListener("change", redraw);
  canvas.addEventListener("keydown", (event) => turnByKey(event, camera, controls));
  canvas.addEventListener("wheel", (event) => { if (!event.ctrlKey) event.stopImmediatePropagation(); }, { capture: true });
  new ResizeObserver(() => {
    const { clientWidth: width, clientHeight: height } = holder;
    if (!width || !height) return;
    renderer.setPixelRatio(SAMPLES);
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    redraw();
  }).observe(holder);
  return { scene, camera, controls, canvas, redraw, tag: (text, at) => addTag(tags, holder, text, at), lookFrom: lookFrom(camera, controls, redraw) };
}

function addTag(tags, holder, text, at) {
  const node = el("span", { class: "tag", "aria-hidden": "true" }, text);
  holder.append(node);
  tags.push({ node, at: new Vector3(...at) });
}

/** Words stand where their points are, and fade behind the sphere's horizon. */
function placeTags(tags, camera, holder) {
  for (const { node, at } of tags) {
    const p = at.clone().project(camera);
    node.style.left = `${((p.x + 1) / 2) * holder.clientWidth}px`;
    node.style.top = `${((1 - p.y) / 2) * holder.clientHeight}px`;
    node.style.opacity = at.dot(camera.position) > -0.1 ? 1 : 0.25;
  }
}

/** Arrow keys turn, + and - come nearer and go farther. */
function turnByKey(event, camera, controls) {
  const offset = camera.position.clone().sub(controls.target);
  const turns = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  if (event.key in turns) {
    const [across, up] = turns[event.key];
    const radius = offset.length();
    const elevation = Math.asin(offset.z / radius) + up * 0.12;
    const azimuth = Math.atan2(offset.x, -offset.y) + across * 0.15;
    const limited = Math.max(-1.5, Math.min(1.5, elevation));
    offset.set(...onSphere((azimuth * 180) / Math.PI, (limited * 180) / Math.PI, radius));
  } else if (event.key === "+" || event.key === "-") {
    offset.multiplyScalar(event.key === "+" ? 0.87 : 1.15);
  } else {
    return;
  }
  event.preventDefault();
  camera.position.copy(controls.target).add(offset);
  controls.update();
}

const lookFrom = (camera, controls, redraw) => (target, azimuth, elevation, distance) => {
  controls.target.set(...target);
  camera.position.set(...onSphere(azimuth, elevation, distance)).add(controls.target);
  camera.near = distance / 200;
  camera.far = distance * 20;
  camera.updateProjectionMatrix();
  controls.update();
  redraw();
};
