// What a ray meets first, worked out from the data itself: exact, and the same for every drawing.
import { shownPart } from './clip.js';
import { voxelAt } from './data.js';

/**
 * @typedef {object} Hit
 * @property {'surface'|'cylinder'|'voxel'} kind
 * @property {object|number} what   the surface, the cylinder, the voxel's number
 * @property {number} distance      m
 * @property {number[]} place       root coordinates
 */

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const along = (ray, distance) => ray.from.map((x, k) => x + distance * ray.direction[k]);

/** Even-odd over all rings: polygons do not overlap, holes and islands alternate. */
export function inPolygons(surface, x, y) {
  const { u, v, box } = surface;
  if (x < box[0] || y < box[1] || x > box[2] || y > box[3]) return false;
  let inside = false;
  for (const { from, to } of surface.rings) {
    for (let i = from, j = to - 1; i < to; j = i++) {
      if (v[i] > y !== v[j] > y && x < u[i] + (y - v[i]) / (v[j] - v[i]) * (u[j] - u[i])) inside = !inside;
    }
  }
  return inside;
}

function distanceToSurface(surface, ray, [least, most], cut) {
  const toward = dot(surface.axes[2], ray.direction);
  if (Math.abs(toward) < 1e-9 || (cut && toward > 0)) return Infinity;
  const distance = dot(minus(surface.origin, ray.from), surface.axes[2]) / toward;
  if (distance <= least || distance > most) return Infinity;
  const at = minus(along(ray, distance), surface.origin);
  return inPolygons(surface, dot(at, surface.axes[0]), dot(at, surface.axes[1])) ? distance : Infinity;
}

function distanceToCylinder(cylinder, ray, [least, most]) {
  const { axis, axis_point: middle, start, radius_m: radius } = cylinder;
  const from = minus(ray.from, middle);
  const across = (x) => minus(x, axis.map((value) => value * dot(x, axis)));
  const a = across(ray.direction), b = across(from);
  const half = dot(a, b), square = dot(a, a), root = half * half - square * (dot(b, b) - radius * radius);
  if (root < 0 || square < 1e-12) return Infinity;
  const other = cross(axis, start);
  for (const distance of [(-half - Math.sqrt(root)) / square, (-half + Math.sqrt(root)) / square]) {
    const at = minus(along(ray, distance), middle);
    const angle = (Math.atan2(dot(at, other), dot(at, start)) + 2 * Math.PI) % (2 * Math.PI);
    if (distance > least && distance <= most && Math.abs(dot(at, axis)) <= cylinder.length_m / 2 && angle <= cylinder.span_rad)
      return distance;
  }
  return Infinity;
}

/** Walks from cell to cell (Amanatides and Woo 1987) to the first voxel that is `wanted`. */
function voxelOnRay(voxels, ray, wanted, limits) {
  const { low, size, cells } = voxels;
  let [enter, leave] = limits;
  for (let k = 0; k < 3; ++k) {
    const one = (low[k] - ray.from[k]) / ray.direction[k];
    const other = (low[k] + cells[k] * size - ray.from[k]) / ray.direction[k];
    enter = Math.max(enter, Math.min(one, other));
    leave = Math.min(leave, Math.max(one, other));
  }
  if (!(enter < leave)) return null;
  const start = along(ray, enter + 1e-6 * size);
  const cell = start.map((x, k) => Math.min(cells[k] - 1, Math.max(0, Math.floor((x - low[k]) / size))));
  const step = ray.direction.map((x) => (x > 0 ? 1 : -1));
  const next = cell.map((c, k) => (low[k] + (c + (step[k] > 0 ? 1 : 0)) * size - ray.from[k]) / ray.direction[k]);
  const width = ray.direction.map((x) => size / Math.abs(x));
  for (let distance = enter; distance < leave;) {
    const found = voxelAt(voxels, cell[0], cell[1], cell[2]);
    if (found >= 0 && wanted(found)) return { voxel: found, distance };
    const k = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    distance = next[k];
    next[k] += width[k];
    cell[k] += step[k];
    if (cell[k] < 0 || cell[k] >= cells[k]) return null;
  }
  return null;
}

/**
 * @param {object} map  see data.js
 * @param {{from: number[], direction: number[]}} ray
 * @param {{surfaces: boolean, cylinders: boolean, voxels: boolean, pending: boolean, cut: boolean,
 *          heights: [number, number]}} shown
 * @returns {Hit?}
 */
export function pick(map, ray, shown) {
  let best = { distance: Infinity };
  const part = shownPart(ray, map.up, shown.heights);
  const nearer = (kind, what, distance) => {
    if (distance < best.distance) best = { kind, what, distance };
  };
  if (shown.surfaces)
    for (const surface of map.surfaces) nearer('surface', surface, distanceToSurface(surface, ray, part, shown.cut));
  if (shown.cylinders)
    for (const cylinder of map.cylinders) nearer('cylinder', cylinder, distanceToCylinder(cylinder, ray, part));
  if (map.voxels && (shown.voxels || shown.pending)) {
    const wanted = shown.voxels ? () => true : (i) => map.voxels.surface[i] === 0;
    const found = voxelOnRay(map.voxels, ray, wanted, [part[0], Math.min(part[1], best.distance)]);
    if (found) nearer('voxel', found.voxel, found.distance);
  }
  if (best.distance === Infinity) return null;
  return { ...best, place: along(ray, best.distance) };
}
