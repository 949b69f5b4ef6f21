// Boundary edges of surfaces, by what lies beyond them.
import { edgeKinds, noLabel } from '../data.js';
import { edgeColors, plainEdge } from '../shading.js';
import { forEachEdge, linesOf } from './surfaces.js';

const costOfEdge = 4;  // of points drawn
const texts = ['real: it ends there', 'occluded: something stood before it', 'sensor limit: its range ended',
  'frontier: nobody has looked'];

/** @returns {number[]} m of each kind */
export function edgeLengths(surface) {
  const lengths = edgeKinds.map(() => 0);
  forEachEdge(surface, (a, b, kind) => {
    if (kind !== noLabel) lengths[kind] += Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  });
  return lengths;
}

export const edges = {
  id: 'edges', label: 'Edges', on: true,
  create(map) {
    const lines = linesOf(map.surfaces, (kind) => edgeColors[kind] ?? plainEdge), object = lines.object(1.8);
    object.userData.draw = (allowed) => {  // all or none
      const cost = costOfEdge * lines.count, whole = cost <= allowed;
      object.geometry.instanceCount = whole ? lines.count : 0;
      return { cost: whole ? cost : 0, whole };
    };
    return object;
  },
  legend: ({ surfaces }) => (surfaces.some((one) => one.edges.some((kind) => kind !== noLabel))
    ? edgeColors.map((color, kind) => ({ line: color, text: texts[kind] }))
    : [{ line: plainEdge, text: 'edge; its kind is known when the map is saved' }]),
};
