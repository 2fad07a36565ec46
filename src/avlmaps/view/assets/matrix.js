// Vectors are arrays of three numbers; matrices are 16 numbers, column by column, as WebGL has them.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => scaled(a, 1 / (length(a) || 1));
const mix = (a, b, t) => add(scaled(a, 1 - t), scaled(b, t));

/** The matrix whose rows are given one after the other, as NumPy has them. */
function fromRows(rows) {
  return Float64Array.from({ length: 16 }, (_, i) => rows[(i % 4) * 4 + Math.floor(i / 4)]);
}

function multiplied(a, b) {
  const product = new Float64Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      for (let k = 0; k < 4; k++) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return product;
}

/** A point through a matrix: x, y, z and w. */
function transformed(m, p) {
  return [0, 1, 2, 3].map((row) => m[row] * p[0] + m[4 + row] * p[1] + m[8 + row] * p[2] + m[12 + row]);
}

const moved = (m, p) => transformed(m, p).slice(0, 3);

/** A direction through the 3x3 part. */
const turned = (m, d) => [0, 1, 2].map((row) => m[row] * d[0] + m[4 + row] * d[1] + m[8 + row] * d[2]);

/** The inverse of a rotation, a scale that is the same on all axes, and a shift. */
function invertedPose(m) {
  const scale2 = m[0] * m[0] + m[1] * m[1] + m[2] * m[2];
  const inverse = new Float64Array(16);
  for (let row = 0; row < 3; row++) {
    for (let column = 0; column < 3; column++) inverse[4 * column + row] = m[4 * row + column] / scale2;
  }
  const shift = turned(inverse, [m[12], m[13], m[14]]);
  inverse.set([-shift[0], -shift[1], -shift[2], 1], 12);
  return inverse;
}
