// SPDX-License-Identifier: Apache-2.0
// Colours of the pages. A contact's weight maps to dark blue (it shares its stiffness with many) up
// to yellow (it has all of it); the map is readable without colour vision.
const stops = [
  [0.27, 0.0, 0.33], [0.23, 0.32, 0.55], [0.13, 0.57, 0.55], [0.37, 0.79, 0.38], [0.99, 0.91, 0.14],
];

export function weightColour(weight: number): [number, number, number] {
  const x = Math.min(1, Math.max(0, weight)) * (stops.length - 1);
  const i = Math.min(stops.length - 2, Math.floor(x));
  const a = stops[i], b = stops[i + 1], f = x - i;
  return [a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), a[2] + f * (b[2] - a[2])];
}

export const series = ['#d95f02', '#1b9e77', '#7570b3', '#e7298a', '#66a61e', '#e6ab02'];

// A colour of style.css, which knows whether the system is light or dark.
export const css = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
// Calls at every change between light and dark.
export function onTheme(changed: () => void) {
  matchMedia('(prefers-color-scheme: light)').addEventListener('change', changed);
}
