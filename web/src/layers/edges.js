// Boundary edges of surfaces, by what lies beyond them.
import * as THREE from 'three';
import { levelCount, surfacesAt } from '../coarse.js';
import { edgeKinds, noLabel, onSurface } from '../data.js';
import { drawByLevels } from '../detail.js';
import { edgeColors } from '../shading.js';
import { Lines, ribbons } from './ribbons.js';

const costOfEdge = 3;  // of points drawn
const texts = ['real: it ends there', 'occluded: something stood before it', 'sensor limit: its range ended',
  'frontier: nobody has looked'];

/** Calls `visit(from, to, kind)` for each edge of the surface. */
export function forEachEdge(surface, visit) {
  for (const { from, to } of surface.rings) {
    for (let k = from; k < to; ++k) {
      const next = k + 1 < to ? k + 1 : from;
      visit(onSurface(surface, surface.u[k], surface.v[k]),
        onSurface(surface, surface.u[next], surface.v[next]), surface.edges[k]);
    }
  }
}

/** @returns {number[]} m of each kind */
export function edgeLengths(surface) {
  const lengths = edgeKinds.map(() => 0);
  forEachEdge(surface, (a, b, kind) => {
    if (kind !== noLabel) lengths[kind] += Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  });
  return lengths;
}

export function linesOf(surfaces, colorOf) {
  const lines = new Lines();
  for (const surface of surfaces)
    forEachEdge(surface, (from, to, kind) => lines.add(from, to, colorOf(kind), surface.normal));
  return lines;
}

const isByKind = ({ settings }) => settings.choice.edges !== 'plain';

export const edges = {
  id: 'edges', label: 'Edges', on: true,
  choices: () => [{ id: 'kind', label: 'by kind' }, { id: 'plain', label: 'plain' }],
  create(map, context) {
    const byKind = isByKind(context);
    const ink = context.ink();
    const group = new THREE.Group();
    drawByLevels(group, levelCount + 1, (level) => {
      if (level === levelCount) return { object: new THREE.Group(), cost: 0 };  // surfaces' colours must do
      const lines = linesOf(surfacesAt(map, level), (kind) => (byKind && kind !== noLabel ? edgeColors[kind] : ink));
      const object = ribbons(lines, context, byKind ? 1.8 : 1.2, context.cut);
      return { object, cost: costOfEdge * lines.from.length / 3 };
    });
    return group;
  },
  legend: (map, context) => (isByKind(context)
    ? edgeColors.map((color, kind) => ({ line: color, text: texts[kind] })) : []),
};
