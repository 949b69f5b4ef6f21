// Surfaces of the map before that are no more.
import * as THREE from 'three';
import { changeColors } from '../shading.js';
import { mesh } from './mesh.js';
import { ribbons } from './ribbons.js';
import { linesOf } from './edges.js';
import { goneSince, trianglesOf } from './surfaces.js';

const goneSurfaces = (map, before) =>
  goneSince(map).map(({ id }) => before.surface(id)).filter((surface) => surface !== undefined);

export const gone = {
  id: 'gone', label: 'Gone since before', on: true,
  has: (map, context) => map.changes !== null && context.before !== null,
  count: (map, context) => goneSurfaces(map, context.before).length,
  create(map, context) {
    const surfaces = goneSurfaces(map, context.before);
    const group = new THREE.Group(), cut = { value: false };
    group.add(mesh(trianglesOf(surfaces, () => changeColors.gone), { ...context, cut, opacity: 0.3 }));
    group.add(ribbons(linesOf(surfaces, () => changeColors.gone), context, 1.6, cut));
    return group;
  },
  legend: () => [{ color: changeColors.gone, text: 'was there before; seen again, it is no more' }],
};
