// Draws a frame's labels on the canvas over its picture.

import { box, categoryName, categoryToken, frameSize } from "report/data.js";
import { percent, token } from "report/dom.js";
import { decodeRle } from "report/rle.js";
import { LAYERS, layers } from "report/state.js";

const SHORT = { front: "F", back: "Bk", left: "L", right: "R", top: "T", bottom: "Bt" };
const MASK_WIDTH = 960;
const bitmaps = new Map();

/** The data URL's picture, decoded once. */
function bitmap(url) {
  if (!bitmaps.has(url)) {
    const image = new Image();
    image.src = url;
    if (bitmaps.size > 400) bitmaps.delete(bitmaps.keys().next().value);
    bitmaps.set(url, image.decode().then(() => image, () => null)); // a server may have none: then nothing is drawn
  }
  return bitmaps.get(url);
}

export const surfaceLayer = (frame) => LAYERS.find((layer) => layer.surface && layers.has(layer.name) && frame.layers[layer.name]);

/** Draw everything that is switched on; `large` adds words, `base` the picture itself. The canvas takes the size it has on the
 *  page, or that `canvas.room()` says, which costs no layout; `trail`: the sensor's frames before, in order. */
export async function draw(canvas, frame, large, base = false, trail = []) {
  const turn = (canvas.drawing = (canvas.drawing ?? 0) + 1);
  const surface = surfaceLayer(frame);
  canvas.parentElement.classList.toggle("dimmed", Boolean(surface));
  const image = surface ? await bitmap((large && frame.layers[`${surface.name}Large`]) || frame.layers[surface.name]) : null;
  const picture = base && frame.layers.rgb ? await bitmap(frame.layers.rgb) : null;
  if (canvas.drawing !== turn) return; // something newer is being drawn
  const ratio = Math.min(window.devicePixelRatio || 1, 3);
  const size = frameSize(frame);
  const [width, height] = canvas.room?.() ?? [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.max(1, Math.round(width * ratio));
  canvas.height = Math.max(1, Math.round(height * ratio));
  const pen = canvas.getContext("2d");
  if (picture) drawPicture(pen, picture, surface);
  if (image) pen.drawImage(image, 0, 0, canvas.width, canvas.height);
  const scale = canvas.width / size.width;
  const view = { pen, scale, ratio, large };
  canvas.drawn = turn;
  if (frame.scan) return; // labels of a LiDAR are in the pixels of its range image, and its points have the objects' colours
  if (layers.has("masks")) drawMasks(view, frame, canvas);
  if (layers.has("boxes3d")) for (const object of frame.objects) drawBox3d(view, object);
  if (layers.has("boxes")) for (const object of frame.objects) drawBox(view, object);
  if (layers.has("tracks") && frame.points) drawTracks(view, frame, trail);
}

/** The picture itself, pale where a layer covers it. */
function drawPicture(pen, picture, surface) {
  pen.globalAlpha = surface ? 0.22 : 1;
  pen.filter = surface ? "grayscale(1)" : "none";
  pen.drawImage(picture, 0, 0, pen.canvas.width, pen.canvas.height);
  pen.globalAlpha = 1;
  pen.filter = "none";
}

/** Each point filled where it is visible and hollow where it is occluded, with a line from where it was before. */
function drawTracks(view, frame, trail) {
  const { pen, ratio } = view;
  const scale = view.scale / 10;
  const radius = Math.max(2, pen.canvas.width / 200);
  const frames = [...trail, frame];
  pen.lineWidth = Math.max(1, radius / 2.5);
  frame.pointColors.forEach((tone, i) => {
    const [x, y, state] = frame.points.slice(3 * i, 3 * i + 3);
    if (x === null || state > 1) return;
    pen.strokeStyle = pen.fillStyle = tone;
    const path = frames.map((f) => f.points.slice(3 * i, 3 * i + 2));
    const first = path.findLastIndex(([u]) => u === null) + 1;
    pen.globalAlpha = 0.6;
    pen.beginPath();
    for (const [u, v] of path.slice(first)) pen.lineTo(u * scale, v * scale);
    pen.stroke();
    pen.globalAlpha = 1;
    pen.beginPath();
    pen.arc(x * scale, y * scale, radius, 0, 2 * Math.PI);
    if (state === 0) pen.fill();
    pen.lineWidth = Math.max(1, ratio);
    pen.stroke();
  });
}

const color = (object) => token(categoryToken(object.category));

/** A line on a dark casing, to be seen on any picture. */
function line(view, tone, path, width) {
  const { pen, ratio } = view;
  pen.lineJoin = "round";
  pen.strokeStyle = "rgba(0, 0, 0, 0.55)";
  pen.lineWidth = (width + 1.6) * ratio;
  pen.stroke(path);
  pen.strokeStyle = tone;
  pen.lineWidth = width * ratio;
  pen.stroke(path);
}

function words(view, text, x, y, object) {
  const { pen, ratio } = view;
  pen.font = `600 ${12 * ratio}px system-ui, sans-serif`;
  const width = pen.measureText(text).width + 10 * ratio;
  const top = Math.max(0, y - 18 * ratio);
  const left = Math.max(0, Math.min(x, pen.canvas.width - width));
  pen.fillStyle = "rgba(12, 14, 17, 0.82)";
  pen.fillRect(left, top, width, 18 * ratio);
  pen.fillStyle = color(object);
  pen.fillRect(left, top, 3 * ratio, 18 * ratio);
  pen.fillStyle = "#ffffff";
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  pen.fillText(text, left + 6 * ratio, top + 9.5 * ratio);
}

function drawBox(view, object) {
  if (!object.box) return;
  const [x0, y0, x1, y1] = object.box.map((v) => v * view.scale);
  const path = new Path2D();
  path.rect(x0, y0, x1 - x0, y1 - y0);
  line(view, color(object), path, 2);
  if (!view.large) return;
  const seen = object.visibility === null ? "" : `, ${percent(object.visibility)} visible`;
  words(view, `${categoryName(object.category)}${seen}`, x0, y0, object);
}

function drawBox3d(view, object) {
  if (!object.corners) return;
  const points = object.corners.map((p) => p && p.map((v) => v * view.scale));
  const seen = new Set(object.faces);
  const facesAt = (a, b) => Object.entries(box.faces).filter(([, corners]) => corners.includes(a) && corners.includes(b));
  const near = new Path2D();
  const far = new Path2D();
  for (const [a, b] of box.edges) {
    if (!points[a] || !points[b]) continue;
    const path = facesAt(a, b).some(([name]) => seen.has(name)) ? near : far;
    path.moveTo(...points[a]);
    path.lineTo(...points[b]);
  }
  const { pen, ratio } = view;
  const tone = paled(color(object));
  pen.setLineDash([4 * ratio, 4 * ratio]);
  line(view, tone, far, 1);
  pen.setLineDash([]);
  for (const name of object.faces) drawFace(view, object, name, points);
  line(view, tone, near, 1.5);
  for (const name of object.faces) nameFace(view, name, points);
}

function facePoints(name, points) {
  const corners = box.faces[name].map((i) => points[i]);
  return corners.every(Boolean) ? corners : null;
}

/** The front is filled, so that one sees at once which way an object faces; paler than a mask under it. */
function drawFace({ pen }, object, name, points) {
  const corners = facePoints(name, points);
  if (!corners || name !== "front") return;
  pen.beginPath();
  corners.forEach((p) => pen.lineTo(...p));
  pen.closePath();
  pen.globalAlpha = layers.has("masks") ? 0.22 : 0.32;
  pen.fillStyle = layers.has("masks") ? paled(color(object)) : color(object);
  pen.fill();
  pen.globalAlpha = 1;
}

function nameFace({ pen, ratio, large }, name, points) {
  const corners = facePoints(name, points);
  if (!corners) return;
  const x = corners.reduce((sum, p) => sum + p[0], 0) / 4;
  const y = corners.reduce((sum, p) => sum + p[1], 0) / 4;
  const area = Math.abs(corners.reduce((sum, p, i) => {
    const q = corners[(i + 1) % 4];
    return sum + p[0] * q[1] - q[0] * p[1];
  }, 0)) / 2;
  const size = (large ? 13 : 10) * ratio;
  pen.font = `600 ${size}px system-ui, sans-serif`;
  const fits = (text) => pen.measureText(text).width * size * 1.7 < area;
  const text = [name, SHORT[name]].find(fits);
  if (!text) return;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.lineWidth = 3 * ratio;
  pen.strokeStyle = "rgba(0, 0, 0, 0.75)";
  pen.strokeText(text, x, y);
  pen.fillStyle = "#ffffff";
  pen.fillText(text, x, y);
}

/** Each object's mask in its category's colour, with an edge that tells neighbours apart. */
function drawMasks(view, frame, canvas) {
  const size = frameSize(frame);
  const step = Math.max(1, Math.ceil(size.width / MASK_WIDTH));
  const width = Math.floor(size.width / step);
  const height = Math.floor(size.height / step);
  const pixels = new ImageData(width, height);
  for (const object of frame.objects) if (object.area > 0) paintMask(pixels, object, step);
  const aside = new OffscreenCanvas(width, height);
  aside.getContext("2d").putImageData(pixels, 0, 0);
  view.pen.drawImage(aside, 0, 0, canvas.width, canvas.height);
}

function paintMask(pixels, object, step) {
  const { width, height } = pixels;
  const [rows, columns, code] = object.rle;
  const mask = decodeRle(code, rows, columns);
  const [r, g, b] = rgb(color(object));
  const fill = layers.has("boxes3d") ? 90 : 150; // the faces and their names are read through it
  const inside = (x, y) => x >= 0 && y >= 0 && x < width && y < height && mask[x * step * rows + y * step];
  for (let x = 0; x < width; x++) {
    for (let y = 0; y < height; y++) {
      if (!inside(x, y)) continue;
      const edge = !(inside(x - 1, y) && inside(x + 1, y) && inside(x, y - 1) && inside(x, y + 1));
      pixels.data.set([r, g, b, edge ? 255 : fill], 4 * (y * width + x));
    }
  }
}

/** The colour half way to white: 3D boxes are told from 2D ones of the same category. */
const paled = (hex) => `rgb(${rgb(hex).map((v) => Math.round((v + 2 * 255) / 3)).join(" ")})`;

function rgb(hex) {
  const value = parseInt(hex.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}
