// Where on each surface the middle of a foot may be: contact regions.
import { outlineOf } from '../data.js';
import { patches } from './surfaces.js';

const color = [0.05, 0.75, 0.85], edgeColor = [0, 0.4, 0.55];

/** The foot whose regions are shown: that which was chosen, else the first. */
export function footOf(map, settings) {
  return map.feet.find((foot) => foot.name === settings.choice.regions) ?? map.feet[0] ?? null;
}

/** @returns {object?} the region of that foot on a surface, empty ones too */
export function regionOn(foot, id) {
  return foot?.regions.find((one) => one.surface === id) ?? null;
}

/** Regions of the surfaces that the map still has, as if they were surfaces. */
function shapesOf(map, foot) {
  return foot.regions.flatMap(({ surface: id, polygons }) => {
    const surface = map.surface(id);
    return surface ? [{ ...surface, ...outlineOf(map, surface, polygons) }] : [];
  });
}

export const regions = {
  id: 'regions', label: 'Contact regions', on: false,
  has: (map) => map.feet.length > 0,
  count: (map, settings) => footOf(map, settings).regions.filter(({ polygons }) => polygons.length > 0).length,
  choices: (map) => map.feet.map(({ name }) => ({ id: name, label: name })),
  create: (map, { settings }) =>
    patches(map, shapesOf(map, footOf(map, settings)), color, edgeColor, { opacity: 0.7, width: 1.4 }),
  legend: (map, settings) => [{ color, text: `the middle of a foot may be here: ${footOf(map, settings).name}` }],
};
