// Cylinders: the part of the lateral surface that was seen.
import { cross } from '../vectors.js';
import { Triangles } from './mesh.js';

const color = [0.85, 0.55, 0.2];
const stepRad = Math.PI / 24;

const facets = ({ span_rad: span }) => Math.max(1, Math.ceil(span / stepRad));

/** @param {Triangles} triangles two are added for each facet */
export function addMantle(triangles, map, cylinder, tint = color) {
  const { axis_point: middle, axis, radius_m: radius, length_m: length, start, span_rad: span } = cylinder;
  const other = cross(axis, start), count = facets(cylinder), at = (i) => span * i / count;
  const outward = (angle) => start.map((x, k) => Math.cos(angle) * x + Math.sin(angle) * other[k]);
  for (let i = 0; i < count; ++i) {
    const places = [at(i), at(i + 1)].map(outward).flatMap((out) => [-0.5, 0.5].map((end) =>
      middle.map((x, k) => x + radius * out[k] + end * length * axis[k])));
    triangles.add(map, places, outward(at(i + 0.5)), tint, [0, 2, 1, 1, 2, 3]);
  }
}

export const cylinders = {
  id: 'cylinders', label: 'Cylinders', on: true,
  has: (map) => map.cylinders.length > 0,
  count: (map) => map.cylinders.length,
  create(map) {
    const triangles = new Triangles(), owners = [];
    for (const cylinder of map.cylinders) {
      addMantle(triangles, map, cylinder);
      owners.push(...Array(2 * facets(cylinder)).fill(cylinder));
    }
    const object = triangles.mesh();
    object.userData.whose = (triangle) => owners[triangle];
    return object;
  },
  legend: () => [{ color, text: 'cylinder, as far as it was seen' }],
};
