// What can be switched on and off, in the panel's order:
//
//   id, label         its name in settings and for readers
//   on                at first
//   has(map)          whether there is anything of it; always, if left out
//   count(map, settings)  shown behind the label, if given
//   choices(map)      ways to colour it, or what of it is shown: [{id, label}], the first at first
//   create(map, stage)    a three.js object in root coordinates (view.js); made when it is first shown, and again
//                     when a choice or the map changes. If it has userData.draw, it is drawn by that, before each
//                     picture (allowed points → {cost, whole}). userData.whose(triangle): for picking.js.
//   legend(map, settings)   [{color | line | ramp, text | low, high}]
import { surfaces } from './surfaces.js';
import { edges } from './edges.js';
import { voxels } from './voxels.js';
import { stairs } from './stairs.js';

export const layers = [surfaces, edges, voxels, stairs];
