// SPDX-License-Identifier: Apache-2.0
// The Gauss sphere: normals N (red) and torque directions T (blue) of all contacts, seen in the
// direction of the scene's camera. Dots on the far side are faint.
import { Quaternion, Vector3 } from 'three';
import { css } from './colours';

export class GaussSphere {
  private turn = new Quaternion();
  private point = new Vector3();

  constructor(private canvas: HTMLCanvasElement) {}

  draw(normals: Float32Array, torques: Float32Array, weights: Float32Array, camera: Quaternion) {
    const c = this.canvas, ratio = window.devicePixelRatio || 1;
    const size = Math.max(80, Math.min(c.clientWidth, c.clientHeight)) * ratio;
    if (c.width !== Math.round(c.clientWidth * ratio)) c.width = Math.round(c.clientWidth * ratio);
    if (c.height !== Math.round(c.clientHeight * ratio)) c.height = Math.round(c.clientHeight * ratio);
    const g = c.getContext('2d')!;
    const x0 = c.width / 2, y0 = c.height / 2, r = size / 2 - 8 * ratio;
    g.clearRect(0, 0, c.width, c.height);
    g.fillStyle = css('sphere');
    g.strokeStyle = css('edge');
    g.lineWidth = ratio;
    g.beginPath();
    g.arc(x0, y0, r, 0, 7);
    g.fill();
    g.stroke();
    this.turn.copy(camera).invert();
    for (let axis = 0; axis < 3; ++axis) this.circle(g, axis, x0, y0, r);
    this.dots(g, torques, weights, css('torque'), x0, y0, r, 2.2 * ratio);
    this.dots(g, normals, weights, css('normal'), x0, y0, r, 2.8 * ratio);
  }

  private circle(g: CanvasRenderingContext2D, axis: number, x0: number, y0: number, r: number) {
    g.strokeStyle = css('line');
    g.beginPath();
    for (let i = 0; i <= 64; ++i) {
      const a = (i * Math.PI) / 32, u = Math.cos(a), v = Math.sin(a);
      this.point.set(axis === 0 ? 0 : u, axis === 1 ? 0 : axis === 0 ? u : v, axis === 2 ? 0 : v);
      this.point.applyQuaternion(this.turn);
      g.lineTo(x0 + r * this.point.x, y0 - r * this.point.y);
    }
    g.stroke();
  }

  private dots(g: CanvasRenderingContext2D, v: Float32Array, weights: Float32Array, colour: string,
               x0: number, y0: number, r: number, size: number) {
    g.fillStyle = colour;
    for (let i = 0; 3 * i + 2 < v.length; ++i) {
      this.point.set(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
      if (this.point.lengthSq() < 1e-6) continue;
      this.point.applyQuaternion(this.turn);
      const shown = 0.35 + 0.65 * Math.min(1, Math.sqrt(weights[i] ?? 1));
      g.globalAlpha = this.point.z > 0 ? shown : 0.25 * shown;
      g.beginPath();
      g.arc(x0 + r * this.point.x, y0 - r * this.point.y, size, 0, 7);
      g.fill();
    }
    g.globalAlpha = 1;
  }
}
