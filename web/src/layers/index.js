// What can be switched on and off, in the panel's order:
//
//   id, label         its name in settings and for readers
//   on                at first
//   has(map, stage)   whether there is anything of it; always, if left out
//   count(map, stage) shown behind the label, if given
//   choices(map)      ways to colour it, if there are several: [{id, label}], the first at first
//   range(map, settings)  a slider of its own: {label, least, greatest, value, text(value), set(value)}; null: none
//   create(map, stage)    a three.js object in root coordinates (view.js); made when it is first shown, and again
//                     when a choice, the theme or the map changes. If it has userData.draw, it is drawn by
//                     that, before each picture (allowed points → {cost, whole}). userData.whose(triangle): for picking.js.
//   legend(map, stage)    [{color | line | ramp, text | ticks: [{at: 0 … 1, text}] | low, high}]
import { regions } from './regions.js';
import { surfaces } from './surfaces.js';
import { edges } from './edges.js';
import { cylinders } from './cylinders.js';
import { voxels, pending } from './voxels.js';
import { normals } from './normals.js';
import { stairs } from './stairs.js';
import { axes, grid } from './ground.js';

const needVoxels = (layer) => ({ ...layer, has: (map) => map.voxels !== null });

export const layers = [surfaces, edges, cylinders, needVoxels(pending), needVoxels(voxels), regions, normals, grid, axes, stairs];
