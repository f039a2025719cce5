// COCO's compressed run-length code (maskApi.c, rleFrString): runs down the columns, the first of zeros.

/** (columns * rows) bytes, column after column: 1 inside the mask. */
export function decodeRle(code, rows, columns) {
  const mask = new Uint8Array(rows * columns);
  const runs = [];
  let at = 0;
  let pixel = 0;
  while (at < code.length) {
    let run = 0;
    let shift = 0;
    let byte;
    do {
      byte = code.charCodeAt(at++) - 48;
      run |= (byte & 31) << shift;
      shift += 5;
    } while (byte & 32);
    if (byte & 16) run |= -1 << shift;
    if (runs.length > 2) run += runs[runs.length - 2];
    if (runs.length % 2) mask.fill(1, pixel, pixel + run);
    pixel += run;
    runs.push(run);
  }
  return mask;
}
