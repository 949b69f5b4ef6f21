// What the octree knows at one height: free, occupied, unknown.
import { Quaternion, Vector3 } from 'three';
import { dot } from '../vectors.js';
import { Triangles } from './mesh.js';

const colors = { 1: [0.27, 0.67, 0.86], 2: [0.1, 0.12, 0.16] };  // by OccupancyView::State; unknown space is not drawn

/**
 * The stored cells as they lie with the map's present up: one's middle is `low` + i `steps[0]` + j `steps[1]` +
 * k `steps[2]` in the map frame; they are `thick` along up.
 */
function gridOf({ slices, up }) {
  const back = new Quaternion(...slices.rotation).invert();
  const turned = (place) => new Vector3(...place).applyQuaternion(back).toArray();
  const steps = [turned([slices.cell, 0, 0]), turned([0, slices.cell, 0]), turned([0, 0, slices.step])];
  const low = turned(slices.low), climbs = steps.map((step) => dot(step, up));
  const ends = climbs.map((climb, k) => climb * (slices.count[k] - 1));
  const least = dot(low, up) + ends.reduce((sum, end) => sum + Math.min(0, end), 0);
  const greatest = dot(low, up) + ends.reduce((sum, end) => sum + Math.max(0, end), 0);
  return { low, steps, climbs, thick: Math.max(...climbs.map(Math.abs)), least, greatest };
}

const heightIn = ({ least }, { sliceHeight }) => sliceHeight ?? least + 1;

export const slice = {
  id: 'slice', label: 'Free space', on: false,
  has: (map) => map.slices !== null,
  range(map, settings) {
    const grid = gridOf(map);
    return { label: 'height', least: grid.least, greatest: grid.greatest, step: grid.thick, value: heightIn(grid, settings),
      text: (height) => `${height.toFixed(2)} m`, set: (height) => { settings.sliceHeight = height; } };
  },
  create(map, { settings }) {
    const grid = gridOf(map), { low, steps, climbs, thick } = grid, triangles = new Triangles(), { cell, count, states } = map.slices;
    const above = heightIn(grid, settings) - dot(low, map.up), back = new Quaternion(...map.rotation).invert();
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) =>
      new Vector3(x * cell / 2, y * cell / 2, 0).applyQuaternion(back).toArray());
    for (let at = 0; at < states.length; ++at) {
      const cells = [at % count[0], Math.floor(at / count[0]) % count[1], Math.floor(at / count[0] / count[1])];
      const off = dot(cells, climbs) - above;
      if (states[at] === 0 || off <= -thick / 2 || off > thick / 2) continue;
      const middle = low.map((x, k) => x - map.origin[k] + steps.reduce((sum, step, i) => sum + cells[i] * step[k], 0) - off * map.up[k]);
      triangles.add(map, corners.map((corner) => corner.map((x, k) => x + middle[k])), map.up, colors[states[at]], [0, 1, 2, 0, 2, 3]);
    }
    return triangles.mesh({ opacity: 0.5 });
  },
  legend: (map) => [{ color: colors[1], text: 'free at that height' }, { color: colors[2], text: 'occupied' },
    { text: `unknown: not drawn; looked up every ${(100 * map.slices.cell).toFixed(0)} cm` }],
};
