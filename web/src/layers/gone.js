// Surfaces of the map before that are no more.
import { changeColors } from '../shading.js';
import { patches } from './surfaces.js';

/** Of the map before: who went, or of whom most is no more. */
const goneSurfaces = ({ changes }, before) =>
  (changes.before ? changes.before.filter(([, shared]) => shared < 0.5).map(([id]) => id) : changes.gone)
    .map((id) => before.surface(id)).filter((surface) => surface !== undefined);

export const gone = {
  id: 'gone', label: 'Gone since before', on: true,
  has: ({ changes }, { before }) => changes !== null && before !== null,
  count: (map, { before }) => goneSurfaces(map, before).length,
  create: (map, { before }) =>
    patches(map, goneSurfaces(map, before), changeColors.gone, changeColors.gone, { opacity: 0.3, width: 1.6 }),
  legend: () => [{ color: changeColors.gone, text: 'was there before; seen again, it is no more' }],
};
