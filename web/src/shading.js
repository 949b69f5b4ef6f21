// Colours as they are on the screen: the page's shaders write sRGB values as they stand, three.js converts none.
import * as THREE from 'three';
import { dot } from './vectors.js';

/** From the upright frame's point of view; as in src/io/exporters/picture.cpp. */
export const light = new THREE.Vector3(-0.45, -0.25, 0.85).normalize();

/** Lambert's law wrapped around, so that no two of a room's walls look alike and none is black. */
export const shade = (map, normal) => 0.45 + 0.55 * (0.5 + 0.5 * dot(normal, map.light));
export const shadeGlsl = `
  float shade(vec3 normal) { return 0.45 + 0.55 * (0.5 + 0.5 * dot(normal, light)); }
`;

/** Of edges. */
export const plainEdge = [0.3, 0.31, 0.34];

const stops = [
  [0.27, 0.0, 0.33], [0.28, 0.27, 0.55], [0.19, 0.41, 0.56], [0.13, 0.57, 0.55],
  [0.21, 0.72, 0.47], [0.56, 0.84, 0.27], [0.99, 0.91, 0.14],
];
const between = (a, b, part) => a.map((value, k) => value + part * (b[k] - value));

/** Viridis, in seven stops. @param {number} share 0 … 1 */
export function ramp(share) {
  const at = Math.min(1, Math.max(0, share)) * (stops.length - 1), low = Math.min(stops.length - 2, Math.floor(at));
  return between(stops[low], stops[low + 1], at - low);
}
export const rampCss = `linear-gradient(90deg, ${stops.map(css).join(', ')})`;

export const walkableDeg = 30;
const overhangingDeg = 95;  // walls lean a little, and planes by their noise
const flat = [0.1, 0.5, 0.3], steepest = [0.72, 0.85, 0.25];    // of what is walkable
const steep = [0.98, 0.62, 0.2], upright = [0.8, 0.25, 0.25];   // of what is not
export const overhanging = [0.5, 0.45, 0.62];

/** Of a slope: green as far as one walks, then orange to red, with a step between them. */
export function slopeColor(deg) {
  if (deg <= walkableDeg) return between(flat, steepest, deg / walkableDeg);
  if (deg > overhangingDeg) return overhanging;
  return between(steep, upright, Math.min(1, (deg - walkableDeg) / (90 - walkableDeg)));
}
const step = `${walkableDeg / 0.9}%`;
export const slopeCss = `linear-gradient(90deg, ${css(flat)}, ${css(steepest)} ${step}, ${css(steep)} ${step}, ${css(upright)})`;

/** @param {number[]} color 0 … 1 */
export function css(color) {
  return `rgb(${color.map((value) => Math.round(255 * value)).join(' ')})`;
}
