// Which heights are shown: what lies above or below them is hidden, a ceiling, say.
import { heightOfOrigin } from './up.js';

/** @typedef {{from: number?, to: number?}} Clip   m, along up; null: no limit */

export const noClip = () => ({ from: null, to: null });

/** The limits in root coordinates, along up. @param {Clip} clip @returns {[number, number]} */
export function limitsIn(map, clip) {
  const zero = heightOfOrigin(map);
  return [clip.from === null ? -Infinity : clip.from - zero, clip.to === null ? Infinity : clip.to - zero];
}

/** The part of an upright ray that is shown, distances in m. @param {import('three').Ray} ray */
export function shownPart({ origin, direction }, [low, high]) {
  if (Math.abs(direction.z) < 1e-12) return origin.z >= low && origin.z <= high ? [0, Infinity] : [0, -1];
  const ends = [(low - origin.z) / direction.z, (high - origin.z) / direction.z].sort((a, b) => a - b);
  return [Math.max(0, ends[0]), ends[1]];
}
