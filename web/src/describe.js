// What the page says about a thing: a line for the pointer, rows for the panel.
import { edgeKinds, slopeDeg } from './data.js';
import { edgeLengths } from './layers/edges.js';
import { footOf, regionOn } from './layers/regions.js';

/** @typedef {{name: string, text?: string, ids?: {text: string, id: string}[]}} Row */

const fixed = (values, digits) => values.map((value) => value.toFixed(digits)).join('  ');
const mm = (meters) => `${(1000 * meters).toFixed(meters < 0.01 ? 2 : 1)} mm`;
const appearance = (revision) => (revision === 0 ? 'before maps noted that' : `revision ${revision}`);

function centerOf(voxels, i) {
  return [voxels.x[i], voxels.y[i], voxels.z[i]].map((cell, k) => voxels.low[k] + (cell + 0.5) * voxels.size);
}

/** @param {object} map @param {import('./picking.js').Hit} hit */
export function lineOf(map, hit) {
  if (hit.kind === 'surface') {
    const { id, area_m2: area } = hit.what;
    return `surface ${id} · ${area.toFixed(2)} m² · slope ${slopeDeg(hit.what, map.up).toFixed(1)}°`;
  }
  if (hit.kind === 'cylinder')
    return `cylinder c${hit.what.id} · radius ${(100 * hit.what.radius_m).toFixed(1)} cm`;
  const surface = map.voxels.surface[hit.what];
  const whose = surface === 0 ? 'pending' : `of surface ${surface}`;
  return `voxel · log-odds ${map.voxels.logOdds(hit.what).toFixed(2)} · ${whose}`;
}

/** @param {object} settings see stage.js @returns {{title: string, place: string?, rows: Row[], lineage: Row[]}} */
export function describe(map, hit, settings) {
  const { kind, what } = hit;
  // As the command's --at takes it, m.
  const place = hit.place ? map.toMap(hit.place).map((x) => x.toFixed(3)).join(' ') : null;
  if (kind === 'voxel') return { title: 'Voxel', place, rows: voxelRows(map, what), lineage: [] };
  // When it came and changed, and what it came of.
  const lineage = [{ name: 'appeared', text: appearance(what.born) }, { name: 'changed', text: `revision ${what.revision}` }];
  if (kind === 'cylinder') return { title: `Cylinder c${what.id}`, place, rows: cylinderRows(map, what), lineage };
  return { title: `Surface ${what.id}`, place, rows: [...surfaceRows(map, what), ...footRows(map, what, settings)],
    lineage: [...lineage, ...relativeRows(map, what)] };
}

/** @param {{id: number, revision?: number}[]} others @returns {Row[]} */
const idRow = (name, others) => (others.length === 0 ? [] : [{ name, ids: others.map(({ id, revision }) =>
  ({ id: String(id), text: revision === undefined ? String(id) : `${id} (revision ${revision})` })) }]);

const relativeRows = (map, { id, parents }) => [
  ...idRow('out of', parents.map((parent) => ({ id: parent }))),
  ...idRow('took in', map.removedSurfaces.filter(({ into }) => into === id)),
  ...idRow('part went to', map.surfaces.filter((one) => one.parents.includes(id)).map((one) => ({ id: one.id })))];

/** How much of it the foot may stand on whose regions are chosen, or why not. */
function footRows(map, surface, settings) {
  const foot = footOf(map, settings), region = regionOn(foot, surface.id);
  if (!region) return [];
  const text = region.polygons.length > 0 ? `its middle may be on ${region.area_m2.toFixed(3)} m²`
    : `nowhere: ${region.refused.join(', ')}`;
  return [{ name: 'a foot', text: `${text} (${foot.name})` }];
}

function surfaceRows(map, surface) {
  const { polygons } = surface, holes = polygons.reduce((sum, one) => sum + one.holes.length, 0);
  const c = surface.covariance, std = (k) => Math.sqrt(Math.max(0, c[4 * k]));
  const deg = (rad) => `${(rad * 180 / Math.PI).toFixed(3)}°`;
  const lengths = edgeLengths(surface), total = lengths.reduce((sum, one) => sum + one, 0);
  const edges = edgeKinds.map((kind, k) => [kind.replace('_', ' '), lengths[k]]).filter(([, length]) => length > 0)
    .sort((a, b) => b[1] - a[1]).map(([kind, length]) => `${kind} ${(100 * length / total).toFixed(0)} %`);
  return [
    { name: 'area', text: `${surface.area_m2.toFixed(3)} m²` },
    { name: 'slope', text: `${slopeDeg(surface, map.up).toFixed(2)}°` },
    { name: 'normal', text: fixed(surface.normal, 4) },
    { name: 'offset', text: `${surface.offset.toFixed(4)} m` },
    { name: 'σ offset', text: mm(surface.offset_std_m) },
    { name: 'σ normal', text: `${surface.normal_std_deg.toFixed(3)}°` },
    { name: 'σ of tilts', text: `${deg(std(0))} along u, ${deg(std(1))} along v` },
    { name: 'rms', text: `${mm(surface.rms_m)} of ${surface.inliers} voxels` },
    { name: 'outline', text: `${polygons.length} polygon${polygons.length === 1 ? '' : 's'}, ${holes} hole${
      holes === 1 ? '' : 's'}` },
    ...(total > 0 ? [{ name: 'edges', text: edges.join(', ') }] : []),
  ];
}

function cylinderRows(map, cylinder) {
  return [
    { name: 'radius', text: `${(100 * cylinder.radius_m).toFixed(2)} cm` },
    { name: 'length', text: `${cylinder.length_m.toFixed(3)} m` },
    { name: 'axis', text: fixed(cylinder.axis, 4) },
    { name: 'middle', text: `${fixed(map.toMap(cylinder.axis_point), 3)} m` },
    { name: 'seen over', text: `${(cylinder.span_rad * 180 / Math.PI).toFixed(0)}°` },
    { name: 'rms', text: `${mm(cylinder.rms_m)} of ${cylinder.inliers} voxels` },
  ];
}

function voxelRows(map, i) {
  const { voxels } = map, logOdds = voxels.logOdds(i), id = voxels.surface[i];
  return [
    { name: 'centre', text: `${fixed(map.toMap(centerOf(voxels, i)), 3)} m` },
    { name: 'edge', text: `${(100 * voxels.size).toFixed(1)} cm` },
    { name: 'occupied', text: `${(100 / (1 + Math.exp(-logOdds))).toFixed(1)} %, log-odds ${logOdds.toFixed(2)}` },
    ...(id === 0 ? [{ name: 'surface', text: 'none: pending' }] : idRow('surface', [{ id }])),
  ];
}

/**
 * What became of a surface or cylinder that somebody knows by its id.
 * @param {string} text "12", "c3"
 * @returns {{hit?: object, answer: string, successor?: string}}
 */
export function find(map, text) {
  const [, letter, digits] = text.trim().match(/^#?\s*(c?)\s*(\d+)$/i) ?? [];
  if (digits === undefined) return { answer: 'An id is a number, a cylinder’s c and a number.' };
  const id = Number(digits), isCylinder = letter !== '';
  const what = isCylinder ? map.cylinder(id) : map.surface(id);
  if (what) return { hit: { kind: isCylinder ? 'cylinder' : 'surface', what }, answer: '' };
  const removed = (isCylinder ? map.removedCylinders : map.removedSurfaces).find((one) => one.id === id);
  const name = isCylinder ? `cylinder c${id}` : `surface ${id}`;
  if (!removed) return { answer: `There is no ${name}, and none went.` };
  if (removed.into === 0) return { answer: `${name} went at revision ${removed.revision}.` };
  const successor = `${isCylinder ? 'c' : ''}${removed.into}`;
  return { answer: `${name} went into ${successor} at revision ${removed.revision}.`, successor };
}
