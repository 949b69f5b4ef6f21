// What a map was before: its surfaces and cylinders at the moments of its history (src/io/exporters/page_history.cpp),
// each as a map that the page shows like any other.
import { ShapeUtils, Vector2 } from 'three';
import { cylindersOf, indexed, noLabel, surfaceFrom } from './data.js';
import { summed } from './block.js';

/** Three vertices a triangle; of a ring that crosses itself about what it encloses. */
function trianglesOf({ u, v, rings }) {
  const corners = [];
  for (let k = 0; k < rings.length;) {
    const first = rings[k].from, parts = [];
    do {
      const points = [];
      for (let i = rings[k].from; i < rings[k].to; ++i) points.push(new Vector2(u[i], v[i]));
      parts.push(points);
    } while (++k < rings.length && !rings[k].outer);
    const [contour, ...holes] = parts;
    for (const corner of ShapeUtils.triangulateShape(contour, holes)) corners.push(...corner.map((i) => first + i));
  }
  return Uint32Array.from(corners);
}

/** A surface's triangles are worked out when it is first drawn: a history has thousands that nobody looks at. */
function pastSurface(stored, part) {
  const surface = surfaceFrom({ ...stored, pose: [...stored.pose, 0, 0, 0, 1] }, part);
  let corners;
  Object.defineProperty(surface, 'corners', { enumerable: true, get: () => (corners ??= trianglesOf(surface)) });
  return Object.assign(surface, { past: true, normal: surface.axes[2], parents: [] });
}

const sorted = (byId) => [...byId.values()].sort((a, b) => a.id - b.id);

/** What became of each since the moment before; a merger is not told from what went. */
function changesOf(before, moment) {
  const ids = (list) => list.map(({ id }) => id);
  const appeared = moment.surfaces.filter(({ id }) => !before.has(id));
  const changed = moment.surfaces.filter(({ id }) => before.has(id));
  return { by: 'ids', appeared: ids(appeared), changed: ids(changed), gone: moment.gone, merged: [], split: [] };
}

/** @param {object} map that came of it @returns {object[]} maps, oldest first; `elapsed_s` from the first */
export function momentsOf(map, json, arrays) {
  if (!json.history) return [];
  const u = summed(arrays.history_u), v = summed(arrays.history_v);
  let vertex = 0;
  const take = (stored) => {
    const count = stored.rings.flat().reduce((sum, size) => sum + size, 0);
    const meters = (all) => Float64Array.from(all.subarray(vertex, vertex + count), (x) => x * json.ring_step_m);
    const part = { u: meters(u), v: meters(v), edges: new Uint8Array(count).fill(noLabel), origin: map.origin };
    vertex += count;
    return pastSurface(stored, part);
  };
  const surfaces = new Map(), cylinders = new Map();
  return json.history.map((moment) => {
    const changes = changesOf(surfaces, moment);
    for (const stored of moment.surfaces) surfaces.set(stored.id, take(stored));
    for (const id of moment.gone) surfaces.delete(id);
    for (const one of cylindersOf(moment, map.origin)) cylinders.set(one.id, one);
    for (const id of moment.cylinders_gone) cylinders.delete(id);
    return indexed({
      name: map.name, revision: moment.revision, resolution: map.resolution, ownUp: map.ownUp,
      suggestedUp: map.suggestedUp, origin: map.origin, toMap: map.toMap, whole: map, changes, merged: 1,
      voxelsBeforeMerging: 0, feetLeftOut: false, momentsLeftOut: map.momentsLeftOut,
      surfaces: sorted(surfaces), cylinders: sorted(cylinders), departedSurfaces: map.departedSurfaces,
      departedCylinders: map.departedCylinders, feet: [], plans: [], voxels: null, slices: null, sensor: null,
      elapsed_s: moment.stamp_s - json.history[0].stamp_s,
    });
  });
}
