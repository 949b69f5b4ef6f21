// Which heights are shown: what lies above or below them is hidden, a ceiling, say.
import { heightOfOrigin } from './up.js';

/** @typedef {{from: number?, to: number?}} Clip   m, along up; null: no limit */

export const noClip = () => ({ from: null, to: null });

/** The limits in root coordinates, along up. @param {Clip} clip @returns {[number, number]} */
export function limitsIn(map, clip) {
  const zero = heightOfOrigin(map);
  return [clip.from === null ? -Infinity : clip.from - zero, clip.to === null ? Infinity : clip.to - zero];
}

/**
 * The part of a ray that is shown, distances in m.
 * @param {{from: number[], direction: number[]}} ray root coordinates
 */
export function shownPart(ray, up, [low, high]) {
  const dot = (a) => a.reduce((sum, x, k) => sum + x * up[k], 0);
  const height = dot(ray.from), climb = dot(ray.direction);
  if (Math.abs(climb) < 1e-12) return height >= low && height <= high ? [0, Infinity] : [Infinity, Infinity];
  const ends = [(low - height) / climb, (high - height) / climb].sort((a, b) => a - b);
  return [Math.max(0, ends[0]), ends[1]];
}
