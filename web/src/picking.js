// The first drawn thing that a ray meets.
import { Raycaster, Vector3 } from 'three';

/**
 * @typedef {object} Hit
 * @property {'surface'|'cylinder'|'voxel'} kind
 * @property {object|number} what   the surface, the cylinder, the voxel's number
 * @property {number} distance      m
 * @property {number[]} place       root coordinates
 */

/** @returns {{what: number, distance: number}?} the first voxel, each met as a box */
function voxelOnRay({ x, y, z, low, size, count }, from, direction, far) {
  const inverse = direction.map((one) => 1 / one), start = from.map((one, k) => (low[k] - one) * inverse[k]);
  const width = inverse.map((one) => size * one), places = [x, y, z];
  let best = null, distance = far;
  for (let i = 0; i < count; ++i) {
    let enter = 0, leave = distance;
    for (let k = 0; k < 3 && enter <= leave; ++k) {
      const one = start[k] + places[k][i] * width[k], other = one + width[k];
      enter = Math.max(enter, Math.min(one, other));
      leave = Math.min(leave, Math.max(one, other));
    }
    if (enter <= leave && enter < distance) [best, distance] = [i, enter];
  }
  return best === null ? null : { what: best, distance };
}

/** @param {import('./stage.js').Stage} stage @param {import('three').Ray} ray upright @returns {Hit?} */
export function pick(stage, ray) {
  const { map, view: { root } } = stage, inRoot = (place) => root.worldToLocal(place.clone()).toArray();
  let best = null;
  if (stage.shows('surfaces')) {
    const [met] = new Raycaster(ray.origin, ray.direction).intersectObject(stage.objects.get('surfaces'), false);
    if (met) {
      const { kind, what } = met.object.userData.whose(met.faceIndex);
      best = { kind, what, distance: met.distance };
    }
  }
  if (stage.shows('voxels')) {
    const direction = new Vector3(...ray.direction).applyQuaternion(root.quaternion.clone().invert());
    const met = voxelOnRay(map.voxels, inRoot(ray.origin), direction.toArray(), best?.distance ?? Infinity);
    if (met) best = { kind: 'voxel', ...met };
  }
  return best && { ...best, place: inRoot(ray.at(best.distance, new Vector3())) };
}
