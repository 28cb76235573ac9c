// SPDX-License-Identifier: Apache-2.0
import { css } from './colours';

// Histograms of times: bins of a quarter octave from 1/4 us on, counts on a logarithmic scale.
export const binLow = (bin: number) => 0.25 * 2 ** (bin / 4);

export function percentile(bins: ArrayLike<number>, share: number): number {
  let total = 0;
  for (let i = 0; i < bins.length; ++i) total += bins[i];
  let seen = 0;
  for (let i = 0; i < bins.length; ++i) {
    seen += bins[i];
    if (total > 0 && seen >= share * total) return binLow(i + 1);
  }
  return 0;
}

export function short(us: number): string {
  return us >= 1000 ? `${(us / 1000).toFixed(us < 9950 ? 1 : 0)} ms` : us >= 9.95 ? `${us.toFixed(0)} µs` : `${us.toFixed(1)} µs`;
}

export function drawHistogram(canvas: HTMLCanvasElement, bins: ArrayLike<number>, colour: string,
                              budget: number) {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  const g = canvas.getContext('2d')!;
  const w = canvas.width, h = canvas.height - 14 * ratio;
  let most = 1;
  for (let i = 0; i < bins.length; ++i) most = Math.max(most, bins[i]);
  const step = w / bins.length;
  g.fillStyle = colour;
  for (let i = 0; i < bins.length; ++i) {
    if (!bins[i]) continue;
    const y = (h * Math.log10(1 + bins[i])) / Math.log10(1 + most);
    g.fillRect(i * step, h - y, Math.max(1, step - ratio), y);
  }
  g.fillStyle = css('muted');
  g.font = `${10 * ratio}px sans-serif`;
  for (const mark of [1, 10, 100, 1000]) {
    const x = 4 * Math.log2(mark / 0.25) * step;
    g.fillRect(x, h, ratio, 3 * ratio);
    g.fillText(short(mark), x + 2 * ratio, h + 11 * ratio);
  }
  if (budget > 0) {
    g.fillStyle = css('limit');
    g.fillRect(4 * Math.log2(budget / 0.25) * step, 0, ratio, h);
  }
}
