// Surfaces: their polygons, holes left open, in one of several colours.
import * as THREE from 'three';
import { overhangingDeg, ramp, rampCss, slopeColor, slopeCss } from '../shading.js';
import { onSurface, slopeDeg } from '../data.js';
import { Lines } from './lines.js';
import { Triangles } from './mesh.js';

const unsureMm = 5;  // end of the ramp

export const colorings = {
  own: { label: 'own colour', of: (surface) => surface.color },
  slope: {
    label: 'slope', of: (surface, map, { walkableDeg }) => slopeColor(slopeDeg(surface, map.up), walkableDeg),
    legend: (map, { walkableDeg }) => slopeLegend(walkableDeg),
  },
  certainty: {
    label: 'offset σ', of: (surface) => ramp(surface.offset_std_m * 1000 / unsureMm),
    legend: () => [{ ramp: rampCss, low: '0 mm', high: `${unsureMm} mm and more` }],
  },
};

function slopeLegend(walkableDeg) {
  const ticks = [walkableDeg, ...[0, 30, 60, 90].filter((deg) => Math.abs(deg - walkableDeg) > 12)];
  return [
    { ramp: slopeCss(walkableDeg), ticks: ticks.map((deg) => ({ at: deg / 90, text: `${deg}°` })) },
    { color: slopeColor(0, walkableDeg), text: `slope to ${walkableDeg}°: walkable` },
    { color: slopeColor((walkableDeg + 90) / 2, walkableDeg), text: `steeper than ${walkableDeg}°` },
    { color: slopeColor(180, walkableDeg), text: `over ${overhangingDeg}°: overhanging, a ceiling` },
  ];
}

const chosen = ({ settings }) => {
  const { surfaces: choice } = settings.choice;
  return Object.hasOwn(colorings, choice) ? colorings[choice] : colorings.own;
};

/** Calls `visit(from, to, kind)` for each edge of the surface. */
export function forEachEdge(surface, visit) {
  for (const { from, to } of surface.rings) {
    for (let k = from; k < to; ++k) {
      const next = k + 1 < to ? k + 1 : from;
      visit(onSurface(surface, surface.u[k], surface.v[k]),
        onSurface(surface, surface.u[next], surface.v[next]), surface.edges[k]);
    }
  }
}

/** @param {function(object): number[]} colorOf a surface @returns {Triangles} */
function trianglesOf(map, shown, colorOf) {
  const triangles = new Triangles();
  for (const surface of shown) {
    const places = Array.from(surface.u, (u, i) => onSurface(surface, u, surface.v[i]));
    triangles.add(map, places, surface.normal, colorOf(surface), surface.corners);
  }
  return triangles;
}

/** @param {function(number): number[]} colorOf a kind @returns {Lines} */
export function linesOf(shown, colorOf) {
  const lines = new Lines();
  for (const surface of shown)
    forEachEdge(surface, (from, to, kind) => lines.add(from, to, colorOf(kind), surface.normal));
  return lines;
}

/** What lies on surfaces, in one colour and seen through, with its edges. */
export function patches(map, shown, fill, edge, { opacity, width, cut = false }) {
  return new THREE.Group().add(trianglesOf(map, shown, () => fill).mesh({ opacity, cut }),
    linesOf(shown, () => edge).object(width, cut));
}

export const surfaces = {
  id: 'surfaces', label: 'Surfaces', on: true,
  count: (map) => map.surfaces.length,
  choices: () => Object.entries(colorings).map(([id, one]) => ({ id, label: one.label })),
  range: (map, settings) => (chosen({ settings }) !== colorings.slope ? null : {
    label: 'walkable slope', least: 0, greatest: 90, value: settings.walkableDeg, text: (deg) => `to ${deg}°`,
    set: (deg) => { settings.walkableDeg = deg; },
  }),
  create(map, stage) {
    const coloring = chosen(stage), ends = [];
    const object = trianglesOf(map, map.surfaces, (surface) => coloring.of(surface, map, stage.settings)).mesh(stage.settings);
    map.surfaces.reduce((sum, one, i) => (ends[i] = sum + one.corners.length / 3), 0);
    object.userData.whose = (triangle) => map.surfaces[ends.findIndex((end) => triangle < end)];
    return object;
  },
  legend: (map, stage) => chosen(stage).legend?.(map, stage.settings) ?? [],
};
