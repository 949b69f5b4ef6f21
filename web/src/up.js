// Which way is up: as the map says, or as the reader has chosen.
import { Quaternion } from 'three';
import { light } from './shading.js';

/** Directions to choose from, by their names. */
export const upAxes = { z: [0, 0, 1], y: [0, 1, 0], x: [1, 0, 0], '-z': [0, 0, -1], '-y': [0, -1, 0], '-x': [-1, 0, 0] };

const alongAxis = 0.985;  // cosine of 10°, from which the command names an axis, too

const unit = (up) => up.map((x) => x / Math.hypot(...up));

/** "y", or its numbers where it is along no axis. */
export function nameOfUp(up) {
  const along = (axis) => axis.reduce((sum, x, k) => sum + x * up[k], 0) / Math.hypot(...up);
  const found = Object.entries(upAxes).find(([, axis]) => along(axis) >= alongAxis);
  return found ? found[0] : unit(up).map((x) => x.toFixed(2)).join(' ');
}

/** The quaternion (x, y, z, w) that brings `up` to +z, as upright() of up.hpp. */
export function uprightOf(up) {
  const [x, y, z] = unit(up), across = Math.hypot(x, y);
  if (across < 1e-12) return z > 0 ? [0, 0, 0, 1] : [1, 0, 0, 0];
  const half = Math.atan2(across, z) / 2, sine = Math.sin(half) / across;
  return [y * sine, -x * sine, 0, Math.cos(half)];
}

/** Has the map be looked at with this direction up. */
export function orient(map, up) {
  map.up = unit(up);
  map.rotation = uprightOf(up);
  map.light = light.clone().applyQuaternion(new Quaternion(...map.rotation).invert()).toArray();
}

/** m, along up: of the map frame's zero over that of root coordinates. */
export const heightOfOrigin = (map) => map.origin.reduce((sum, x, k) => sum + x * map.up[k], 0);
