// What the page says about a thing: a line for the pointer, rows for the panel.
import { slopeDeg } from './data.js';

const fixed = (values, digits) => values.map((value) => value.toFixed(digits)).join('  ');
const mm = (meters) => `${(1000 * meters).toFixed(meters < 0.01 ? 2 : 1)} mm`;
const deg = (rad) => `${(rad * 180 / Math.PI).toFixed(3)}°`;

/** @param {object} map @param {import('./picking.js').Hit} hit */
export function lineOf(map, { kind, what }) {
  if (kind === 'surface')
    return `surface ${what.id} · ${what.area_m2.toFixed(2)} m² · slope ${slopeDeg(what, map.up).toFixed(1)}°`;
  if (kind === 'cylinder') return `cylinder c${what.id} · radius ${(100 * what.radius_m).toFixed(1)} cm`;
  return `voxel · log-odds ${map.voxels.logOdds(what).toFixed(2)} · ${ownerOf(map, what)}`;
}

const ownerOf = ({ voxels }, i) => (voxels.surface[i] === 0 ? 'pending' : `of surface ${voxels.surface[i]}`);

/** @returns {{title: string, place: string, rows: [string, string][]}} */
export function describe(map, { kind, what, place }) {
  const [title, rows] = kind === 'voxel' ? ['Voxel', voxelRows(map, what)]
    : kind === 'cylinder' ? [`Cylinder c${what.id}`, cylinderRows(map, what)]
    : [`Surface ${what.id}`, surfaceRows(map, what)];
  return { title, place: map.toMap(place).map((x) => x.toFixed(3)).join(' '), rows };
}

function surfaceRows(map, surface) {
  const { polygons } = surface, holes = polygons.reduce((sum, one) => sum + one.holes.length, 0);
  const c = surface.covariance, std = (k) => Math.sqrt(Math.max(0, c[4 * k]));
  return [
    ['area', `${surface.area_m2.toFixed(3)} m²`],
    ['slope', `${slopeDeg(surface, map.up).toFixed(2)}°`],
    ['normal', fixed(surface.normal, 4)],
    ['offset', `${surface.offset.toFixed(4)} m`],
    ['σ offset', mm(surface.offset_std_m)],
    ['σ normal', `${surface.normal_std_deg.toFixed(3)}°`],
    ['σ of tilts', `${deg(std(0))} along u, ${deg(std(1))} along v`],
    ['rms', `${mm(surface.rms_m)} of ${surface.inliers} voxels`],
    ['outline', `${polygons.length} polygon${polygons.length === 1 ? '' : 's'}, ${holes} hole${holes === 1 ? '' : 's'}`],
  ];
}

function cylinderRows(map, cylinder) {
  return [
    ['radius', `${(100 * cylinder.radius_m).toFixed(2)} cm`],
    ['length', `${cylinder.length_m.toFixed(3)} m`],
    ['axis', fixed(cylinder.axis, 4)],
    ['middle', `${fixed(map.toMap(cylinder.axis_point), 3)} m`],
    ['seen over', `${cylinder.span_deg.toFixed(0)}°`],
    ['rms', `${mm(cylinder.rms_m)} of ${cylinder.inliers} voxels`],
  ];
}

function voxelRows(map, i) {
  const { x, y, z, low, size, logOdds } = map.voxels, center = [x, y, z].map((cells, k) => low[k] + (cells[i] + 0.5) * size);
  return [
    ['centre', `${fixed(map.toMap(center), 3)} m`],
    ['edge', `${(100 * size).toFixed(1)} cm`],
    ['occupied', `${(100 / (1 + Math.exp(-logOdds(i)))).toFixed(1)} %, log-odds ${logOdds(i).toFixed(2)}`],
    ['point', ownerOf(map, i)],
  ];
}
