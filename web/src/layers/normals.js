// An arrow on each surface, along its normal.
import { middleOf } from '../data.js';
import { Lines, ribbons } from './ribbons.js';

const length = 0.15, head = 0.035;  // m

export const normals = {
  id: 'normals', label: 'Normals', on: false,
  create(map, context) {
    const lines = new Lines();
    const ink = context.ink();
    for (const surface of map.surfaces) {
      const foot = middleOf(surface), [u, v, n] = surface.axes;
      const at = (along, aside, axis) => [0, 1, 2].map((k) => foot[k] + along * n[k] + aside * axis[k]);
      const tip = at(length, 0, u);
      lines.add(foot, tip, ink, n);
      for (const axis of [u, v])
        for (const side of [-head, head]) lines.add(tip, at(length - 1.5 * head, side / 2, axis), ink, n);
    }
    return ribbons(lines, context, 1.5, context.cut);
  },
};
