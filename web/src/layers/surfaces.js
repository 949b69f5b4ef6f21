// Surfaces: their polygons, holes left open, in one of several colours.
import * as THREE from 'three';
import { changeColors, css, overhangingDeg, ramp, rampCss, slopeColor, slopeCss } from '../shading.js';
import { onSurface, slopeDeg } from '../data.js';
import { levelCount, surfacesAt } from '../coarse.js';
import { drawByLevels } from '../detail.js';
import { mesh } from './mesh.js';

const costOfTriangle = 1.4;  // measured without a graphics card, as that of edges
const unsureMm = 5;        // end of the ramp

/** What became of each surface since the map before: for `by ids` a word, for `by place` the share that is new. */
export function changeOf(map, id) {
  const { changes } = map;
  if (!changes) return null;
  if (changes.by === 'place') {
    const found = changes.after.find(([one]) => one === id);
    return { share: found ? 1 - found[1] : 1, word: 'new here' };
  }
  if (changes.split.some(([, now]) => now === id)) return { word: 'split' };
  if (changes.appeared.includes(id)) return { word: 'appeared' };
  if (changes.changed.includes(id)) return { word: 'changed' };
  return { word: 'same' };
}

/** @returns {{id: number, share: number}[]} of the map before: who went, or how much of whom is no more */
export function goneSince(map) {
  const { changes } = map;
  if (!changes) return [];
  if (changes.by === 'place')
    return changes.before.map(([id, shared]) => ({ id, share: 1 - shared })).filter(({ share }) => share > 0.5);
  return changes.gone.map((id) => ({ id, share: 1 }));
}

function mixed(a, b, part) {
  return a.map((value, k) => value + part * (b[k] - value));
}

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
  change: {
    label: 'what changed', needsBefore: true,
    of: (surface, map) => {
      const change = changeOf(map, surface.id);
      if (!change) return changeColors.same;
      if (change.share !== undefined) return mixed(changeColors.same, changeColors.appeared, change.share);
      return changeColors[change.word];
    },
    legend: (map) => changeLegend(map),
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

function changeLegend(map) {
  if (map.changes?.by === 'place') {
    return [
      { ramp: `linear-gradient(90deg, ${css(changeColors.same)}, ${css(changeColors.appeared)})`,
        low: 'there before', high: 'not there before' },
      { color: changeColors.gone, text: 'seen again, most of it is no more' },
    ];
  }
  return [
    { color: changeColors.appeared, text: 'appeared' }, { color: changeColors.changed, text: 'changed' },
    { color: changeColors.split, text: 'split off another' },
    { color: changeColors.same, text: 'as before' },
    { color: changeColors.gone, text: 'gone' },
  ];
}

const chosen = ({ settings }) => {
  const { surfaces: choice } = settings.choice;
  return Object.hasOwn(colorings, choice) ? colorings[choice] : colorings.own;
};

/** All triangles of some surfaces in one mesh. */
export function trianglesOf(surfaces, colorOf) {
  const vertices = surfaces.reduce((sum, one) => sum + one.u.length, 0);
  const corners = surfaces.reduce((sum, one) => sum + one.corners.length, 0);
  const parts = {
    positions: new Float32Array(3 * vertices), normals: new Float32Array(3 * vertices),
    colors: new Uint8Array(3 * vertices), indices: new Uint32Array(corners),
  };
  let vertex = 0, corner = 0;
  for (const surface of surfaces) {
    const color = colorOf(surface).map((value) => Math.round(255 * value));
    for (const one of surface.corners) parts.indices[corner++] = vertex + one;
    for (let i = 0; i < surface.u.length; ++i, ++vertex) {
      parts.positions.set(onSurface(surface, surface.u[i], surface.v[i]), 3 * vertex);
      parts.normals.set(surface.normal, 3 * vertex);
      parts.colors.set(color, 3 * vertex);
    }
  }
  return parts;
}

export const surfaces = {
  id: 'surfaces', label: 'Surfaces', on: true,
  count: (map) => map.surfaces.length,
  choices: (map) => Object.entries(colorings)
    .filter(([, one]) => !one.needsBefore || map.changes)
    .map(([id, one]) => ({ id, label: one.label })),
  range: (map, settings) => (chosen({ settings }) !== colorings.slope ? null : {
    label: 'walkable slope', least: 0, greatest: 90, value: settings.walkableDeg, text: (deg) => `to ${deg}°`,
    set: (deg) => { settings.walkableDeg = deg; },
  }),
  create(map, context) {
    const coloring = chosen(context);
    const group = new THREE.Group();
    drawByLevels(group, levelCount, (level) => {
      const parts = trianglesOf(surfacesAt(map, level), (surface) => coloring.of(surface, map, context.settings));
      return { object: mesh(parts, context), cost: costOfTriangle * parts.indices.length / 3 };
    });
    return group;
  },
  legend(map, context) {
    const coloring = chosen(context);
    return coloring.legend ? coloring.legend(map, context.settings) : [];
  },
};
