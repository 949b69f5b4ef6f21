// A line on each surface, along its normal.
import { middleOf } from '../data.js';
import { Lines } from './lines.js';

const length = 0.15;  // m

export const normals = {
  id: 'normals', label: 'Normals', on: false,
  create(map, { theme: { ink }, settings }) {
    const lines = new Lines();
    for (const surface of map.surfaces) {
      const foot = middleOf(surface);
      lines.add(foot, foot.map((x, k) => x + length * surface.normal[k]), ink, surface.normal);
    }
    return lines.object(2.5, settings.cut);
  },
};
