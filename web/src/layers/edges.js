// Boundary edges of surfaces.
import { plainEdge } from '../shading.js';
import { linesOf } from './surfaces.js';

const costOfEdge = 4;  // of points drawn

export const edges = {
  id: 'edges', label: 'Edges', on: true,
  create(map) {
    const lines = linesOf(map.surfaces, plainEdge), object = lines.object(1.8);
    object.userData.draw = (allowed) => {  // all or none
      const cost = costOfEdge * lines.count, whole = cost <= allowed;
      object.geometry.instanceCount = whole ? lines.count : 0;
      return { cost: whole ? cost : 0, whole };
    };
    return object;
  },
  legend: () => [{ line: plainEdge, text: 'edge' }],
};
