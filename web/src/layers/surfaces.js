// Surfaces: their polygons, holes left open, in one of several colours; and cylinders, as far as they were seen.
import * as THREE from 'three';
import { overhanging, ramp, rampCss, slopeColor, slopeCss, walkableDeg } from '../shading.js';
import { onSurface, slopeDeg } from '../data.js';
import { Lines } from './lines.js';
import { Triangles } from './mesh.js';

const unsureMm = 5;  // end of the ramp
const cylinderColor = [0.85, 0.55, 0.2];

const colorings = {
  own: { label: 'own colour', of: (surface) => surface.color, legend: [] },
  slope: {
    label: 'slope', of: (surface, map) => slopeColor(slopeDeg(surface, map.up)),
    legend: [{ ramp: slopeCss, low: 'slope 0°', high: '90°' },
      { color: slopeColor(0), text: `to ${walkableDeg}°: walkable` }, { color: overhanging, text: 'overhanging, a ceiling' }],
  },
  certainty: {
    label: 'offset σ', of: (surface) => ramp(surface.offset_std_m * 1000 / unsureMm),
    legend: [{ ramp: rampCss, low: '0 mm', high: `${unsureMm} mm and more` }],
  },
};

const chosen = ({ choice }) => colorings[choice.surfaces] ?? colorings.own;

function addSurface(triangles, map, surface, color) {
  const places = Array.from(surface.u, (u, i) => onSurface(surface, u, surface.v[i]));
  triangles.add(map, places, surface.normal, color, surface.corners);
}

/** @returns {Lines} the edges of all their rings */
export function linesOf(shown, color) {
  const lines = new Lines();
  for (const surface of shown)
    for (const { from, to } of surface.rings)
      for (let k = from; k < to; ++k) {
        const next = k + 1 < to ? k + 1 : from;
        const [a, b] = [k, next].map((i) => onSurface(surface, surface.u[i], surface.v[i]));
        lines.add(a, b, color, surface.normal);
      }
  return lines;
}

/** What lies on surfaces, in one colour and seen through, with its edges. */
export function patches(map, shown, fill, edge, { opacity, width }) {
  const triangles = new Triangles();
  for (const surface of shown) addSurface(triangles, map, surface, fill);
  return new THREE.Group().add(triangles.mesh(opacity), linesOf(shown, edge).object(width));
}

export const surfaces = {
  id: 'surfaces', label: 'Surfaces', on: true,
  count: (map) => map.surfaces.length,
  choices: () => Object.entries(colorings).map(([id, one]) => ({ id, label: one.label })),
  create(map, { settings }) {
    const coloring = chosen(settings), triangles = new Triangles(), owners = [];
    const note = (kind, what) => owners.push({ kind, what, end: triangles.corners.length / 3 });
    for (const surface of map.surfaces) {
      addSurface(triangles, map, surface, coloring.of(surface, map));
      note('surface', surface);
    }
    for (const cylinder of map.cylinders) {
      triangles.addMantle(map, cylinder, cylinderColor);
      note('cylinder', cylinder);
    }
    const object = triangles.mesh();
    object.userData.whose = (triangle) => owners.find(({ end }) => triangle < end);
    return object;
  },
  legend: (map, settings) => [...chosen(settings).legend,
    ...(map.cylinders.length > 0 ? [{ color: cylinderColor, text: 'cylinder, as far as it was seen' }] : [])],
};
