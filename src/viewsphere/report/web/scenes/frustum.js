// What a frame's camera shows, as the ends of lines in camera axes.

import { frameSize } from "report/data.js";

/** Pairs of points [x, y, z]: the lens's own lines, else a pyramid, or a box if its rays are parallel; a LiDAR's shows where ahead is. */
export function frustumLines(frame, size) {
  const { K, lines, parallel } = frame.camera;
  if (lines && !frame.scan) return lines.flatMap((line) => pairs(line, size));
  const { width, height } = frameSize(frame);
  const spread = parallel ? 1 : size;
  const beside = frame.scan ? (u, v) => [(u / width - 0.5) * 0.4 * size, (v / height - 0.5) * 0.4 * size] : (u, v) => [((u - K[0][2]) / K[0][0]) * spread, ((v - K[1][2]) / K[1][1]) * spread];
  const ringAt = (z) => [[0, 0], [width, 0], [width, height], [0, height]].map(([u, v]) => [...beside(u, v), z]);
  const ring = ringAt(size);
  const begin = parallel ? ringAt(0) : ring.map(() => [0, 0, 0]);
  return ring.flatMap((p, i) => [begin[i], p, p, ring[(i + 1) % 4], ...(parallel ? [begin[i], begin[(i + 1) % 4]] : [])]);
}

/** The segments of a line x, y, z, x, ... times a size. */
function pairs(line, size) {
  const points = Array.from({ length: line.length / 3 }, (_, i) => line.slice(3 * i, 3 * i + 3).map((v) => v * size));
  return points.slice(1).flatMap((p, i) => [points[i], p]);
}
