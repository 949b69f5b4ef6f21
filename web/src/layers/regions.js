// Where on each surface the middle of a foot may be: contact regions.
import * as THREE from 'three';
import { ShapeUtils, Vector2 } from 'three';
import { linesOf } from './edges.js';
import { mesh } from './mesh.js';
import { ribbons } from './ribbons.js';
import { trianglesOf } from './surfaces.js';

const color = [0.05, 0.75, 0.85], edgeColor = [0, 0.4, 0.55];

/** The foot whose regions are shown: that which was chosen, else the first. */
export function footOf(map, settings) {
  return map.feet.find((foot) => foot.name === settings.choice.regions) ?? map.feet[0] ?? null;
}

/** @returns {object?} the region of that foot on a surface, empty ones too */
export function regionOn(foot, id) {
  return foot?.regions.find((one) => one.surface === id) ?? null;
}

/** As something like a surface, to be drawn as those are. @param {{u: number[], v: number[]}[][]} polygons */
export function regionOnSurface(surface, polygons) {
  const u = [], v = [], rings = [], corners = [];
  for (const polygon of polygons) {
    const points = polygon.map((ring) => ring.u.map((x, i) => new Vector2(x, ring.v[i]))), first = u.length;
    for (const corner of ShapeUtils.triangulateShape(points[0], points.slice(1))) corners.push(...corner.map((i) => first + i));
    polygon.forEach((ring, k) => {
      rings.push({ from: u.length, to: u.length + ring.u.length, outer: k === 0 });
      u.push(...ring.u);
      v.push(...ring.v);
    });
  }
  return { ...surface, u, v, edges: new Uint8Array(u.length), rings, corners };
}

/** Regions of the surfaces that the map still has. */
function shapesOf(map, foot) {
  foot.shapes ??= foot.regions.filter(({ polygons }) => polygons.length > 0).flatMap(({ surface: id, polygons }) => {
    const surface = map.surface(id);
    return surface ? [regionOnSurface(surface, polygons)] : [];
  });
  return foot.shapes;
}

export const regions = {
  id: 'regions', label: 'Contact regions', on: false,
  has: (map) => map.feet.length > 0,
  count: (map, context) => footOf(map, context.settings).regions.filter(({ polygons }) => polygons.length > 0).length,
  choices: (map) => map.feet.map(({ name }) => ({ id: name, label: name })),
  create(map, context) {
    const group = new THREE.Group(), shapes = shapesOf(map, footOf(map, context.settings));
    const inside = mesh(trianglesOf(shapes, () => color), { ...context, opacity: 0.7 });
    // In the plane of what they lie on: they must win there.
    Object.assign(inside.material, { polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 });
    group.add(inside, ribbons(linesOf(shapes, () => edgeColor), context, 1.4, context.cut));
    return group;
  },
  legend: (map, context) => [
    { color, text: `the middle of a foot may be here: ${footOf(map, context.settings).name}` }],
};
