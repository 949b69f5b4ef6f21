// The first drawn thing that a ray meets.
import { Raycaster, Vector3 } from 'three';
import { limitsIn, shownPart } from './clip.js';

/**
 * @typedef {object} Hit
 * @property {'surface'|'cylinder'|'voxel'} kind
 * @property {object|number} what   the surface, the cylinder, the voxel's number
 * @property {number} distance      m
 * @property {number[]} place       root coordinates
 */

/** @returns {{what: number, distance: number}?} the first voxel that is `wanted`, each met as a box */
function voxelOnRay({ x, y, z, low, size, count }, from, direction, wanted, [near, far]) {
  const inverse = direction.map((one) => 1 / one), start = from.map((one, k) => (low[k] - one) * inverse[k]);
  const width = inverse.map((one) => size * one), places = [x, y, z];
  let best = null, distance = far;
  for (let i = 0; i < count; ++i) {
    let enter = near, leave = distance;
    for (let k = 0; k < 3 && enter <= leave; ++k) {
      const one = start[k] + places[k][i] * width[k], other = one + width[k];
      enter = Math.max(enter, Math.min(one, other));
      leave = Math.min(leave, Math.max(one, other));
    }
    if (enter > leave || enter >= distance || !wanted(i)) continue;
    [best, distance] = [i, enter];
  }
  return best === null ? null : { what: best, distance };
}

/** @param {import('./stage.js').Stage} stage @param {import('three').Ray} ray upright @returns {Hit?} */
export function pick(stage, ray) {
  const { map, view: { root } } = stage, [near, far] = shownPart(ray, limitsIn(map, stage.settings.clip));
  const inRoot = (place) => root.worldToLocal(place.clone()).toArray();
  const caster = new Raycaster(ray.origin, ray.direction, near, far);
  let best = null;
  for (const [kind, layer] of [['surface', 'surfaces'], ['cylinder', 'cylinders']]) {
    const [met] = stage.shows(layer) ? caster.intersectObject(stage.objects.get(layer), false) : [];
    if (met && !(met.distance >= best?.distance))
      best = { kind, what: met.object.userData.whose(met.faceIndex), distance: met.distance };
  }
  const all = stage.shows('voxels');
  if (all || stage.shows('pending')) {
    const wanted = all ? () => true : (i) => map.voxels.surface[i] === 0;
    const from = inRoot(ray.origin), direction = new Vector3(...ray.direction).applyQuaternion(root.quaternion.clone().invert());
    const met = voxelOnRay(map.voxels, from, direction.toArray(), wanted, [near, Math.min(far, best?.distance ?? far)]);
    if (met) best = { kind: 'voxel', ...met };
  }
  return best && { ...best, place: inRoot(ray.at(best.distance, new Vector3())) };
}
