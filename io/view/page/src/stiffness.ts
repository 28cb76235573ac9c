// SPDX-License-Identifier: Apache-2.0
// Principal axes of a symmetric 3 x 3 matrix by Jacobi rotations, for the net stiffness.
import { Matrix4 } from 'three';

// `m` is xx yy zz xy xz yz. Returns the eigenvalues and a rotation whose columns are the axes.
export function principalAxes(m: ArrayLike<number>): { values: [number, number, number]; axes: Matrix4 } {
  const a = [[m[0], m[3], m[4]], [m[3], m[1], m[5]], [m[4], m[5], m[2]]];
  const v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let sweep = 0; sweep < 12; ++sweep)
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (Math.abs(a[p][q]) < 1e-12 * (Math.abs(a[p][p]) + Math.abs(a[q][q]))) continue;
      const theta = 0.5 * Math.atan2(2 * a[p][q], a[p][p] - a[q][q]);
      const c = Math.cos(theta), s = Math.sin(theta);
      for (let k = 0; k < 3; ++k) {
        const x = a[k][p], y = a[k][q];
        a[k][p] = c * x + s * y;
        a[k][q] = c * y - s * x;
      }
      for (let k = 0; k < 3; ++k) {
        const x = a[p][k], y = a[q][k];
        a[p][k] = c * x + s * y;
        a[q][k] = c * y - s * x;
        const e = v[k][p], f = v[k][q];
        v[k][p] = c * e + s * f;
        v[k][q] = c * f - s * e;
      }
    }
  const axes = new Matrix4().set(
    v[0][0], v[0][1], v[0][2], 0, v[1][0], v[1][1], v[1][2], 0, v[2][0], v[2][1], v[2][2], 0, 0, 0, 0, 1);
  if (axes.determinant() < 0)
    axes.multiply(new Matrix4().makeScale(1, 1, -1));
  return { values: [a[0][0], a[1][1], a[2][2]], axes };
}
