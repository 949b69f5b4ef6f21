// Boundary edges of surfaces, by what lies beyond them.
import { edgeKinds, noLabel } from '../data.js';
import { edgeColors } from '../shading.js';
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

const isByKind = ({ settings }) => settings.choice.edges !== 'plain';

export const edges = {
  id: 'edges', label: 'Edges', on: true,
  choices: () => [{ id: 'kind', label: 'by kind' }, { id: 'plain', label: 'plain' }],
  create(map, stage) {
    const byKind = isByKind(stage), { ink } = stage.theme;
    const lines = linesOf(map.surfaces, (kind) => (byKind && kind !== noLabel ? edgeColors[kind] : ink));
    const object = lines.object(byKind ? 1.8 : 1.2, stage.settings.cut);
    object.userData.draw = (allowed) => {  // all or none
      const cost = costOfEdge * lines.count, whole = cost <= allowed;
      object.geometry.instanceCount = whole ? lines.count : 0;
      return { cost: whole ? cost : 0, whole };
    };
    return object;
  },
  legend: (map, stage) => (isByKind(stage) ? edgeColors.map((color, kind) => ({ line: color, text: texts[kind] })) : []),
};
