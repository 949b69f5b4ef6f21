// A map as the page's parts use it. Positions are in the map frame less `origin` (32-bit floats are too coarse far
// from zero); `toMap` brings them back for whoever reads them.
import { readTextBlock, summed } from './block.js';
import { orient } from './up.js';

/**
 * @typedef {object} Surface   see include/octosurf/surface.hpp; beside its fields:
 * @property {number} id
 * @property {number[]} color
 * @property {number[]} normal
 * @property {number[]} origin     of its frame
 * @property {number[][]} axes     u, v, normal of its frame
 * @property {Float64Array} u      of all rings' vertices
 * @property {Float64Array} v
 * @property {Uint8Array} edges    kind of the edge from each vertex to the next of its ring; 255: no label
 * @property {{from: number, to: number, outer: boolean}[]} rings   vertices of each: an outer ring, its holes, the next
 * @property {Uint32Array} corners   three vertices a triangle
 * @property {number[]} box        least u, least v, greatest u, greatest v
 *
 * @typedef {object} Voxels
 * @property {number} count
 * @property {number} size         edge, m
 * @property {number[]} low        corner of the grid's first cell
 * @property {number[]} cells      extent of the grid
 * @property {Uint16Array} x  @property {Uint16Array} y  @property {Uint16Array} z
 * @property {Uint32Array} surface   id; 0: pending
 * @property {function(number): number} logOdds
 * @property {Float64Array} keys   ascending; for voxelAt()
 */

export const edgeKinds = ['real', 'occluded', 'sensor_limit', 'frontier'];
export const noLabel = 255;

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/**
 * A surface as it is stored, with its part of the arrays.
 * @param {{u: Float64Array, v: Float64Array, edges: Uint8Array, origin: number[]}} part origin: of the page
 */
function surfaceFrom(stored, { u, v, edges, origin }) {
  const rings = [], T = stored.pose;
  let count = 0;
  for (const sizes of stored.rings) {
    sizes.forEach((size, k) => {
      rings.push({ from: count, to: count + size, outer: k === 0 });
      count += size;
    });
  }
  return {
    ...stored, rings, u, v, edges,
    polygons: stored.rings.length,
    holes: stored.rings.reduce((sum, sizes) => sum + sizes.length - 1, 0),
    origin: minus([T[3], T[7], T[11]], origin),
    axes: [0, 1, 2].map((k) => [T[k], T[4 + k], T[8 + k]]),
    box: boxOf({ u, v }),
  };
}

function surfacesOf(json, arrays, origin) {
  const u = summed(arrays.ring_u), v = summed(arrays.ring_v), corners = summed(arrays.triangles);
  let vertex = 0, corner = 0;
  return json.surfaces.map((stored) => {
    const count = stored.rings.flat().reduce((sum, size) => sum + size, 0);
    const meters = (all) => Float64Array.from(all.subarray(vertex, vertex + count), (x) => x * json.ring_step_m);
    const surface = surfaceFrom(stored,
      { u: meters(u), v: meters(v), edges: arrays.ring_edges.subarray(vertex, vertex + count), origin });
    surface.corners = corners.subarray(corner, corner + 3 * stored.triangles);
    vertex += count;
    corner += 3 * stored.triangles;
    return surface;
  });
}

function boxOf({ u, v }) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = 0; i < u.length; ++i) {
    box[0] = Math.min(box[0], u[i]);
    box[1] = Math.min(box[1], v[i]);
    box[2] = Math.max(box[2], u[i]);
    box[3] = Math.max(box[3], v[i]);
  }
  return box;
}

/** @param {number[]} ids of the surfaces that the block's voxels are numbered by, from 1 */
function voxelsOf(json, arrays, origin, ids) {
  if (!json.voxels) return null;
  const { size, low, least_log_odds: least, log_odds_step: step } = json.voxels;
  const x = summed(arrays.voxel_x), y = summed(arrays.voxel_y), z = summed(arrays.voxel_z);
  const cells = [x, y, z].map((all) => all.reduce((most, one) => (one > most ? one : most), 0) + 1);
  const keys = new Float64Array(x.length);
  for (let i = 0; i < x.length; ++i) keys[i] = (z[i] * cells[1] + y[i]) * cells[0] + x[i];
  return {
    count: x.length, size, cells, x, y, z, keys,
    low: minus(low.map((cell) => cell * size), origin),
    surface: arrays.voxel_surface.map((number) => (number === 0 ? 0 : ids[number - 1])),
    logOdds: (i) => least + step * arrays.voxel_log_odds[i],
    leastLogOdds: least, greatestLogOdds: least + 255 * step,
  };
}

/** The number of the voxel in a cell of the grid, or -1. */
export function voxelAt(voxels, x, y, z) {
  const key = (z * voxels.cells[1] + y) * voxels.cells[0] + x;
  let low = 0, high = voxels.count - 1;
  while (low <= high) {
    const middle = (low + high) >> 1;
    if (voxels.keys[middle] === key) return middle;
    if (voxels.keys[middle] < key) low = middle + 1;
    else high = middle - 1;
  }
  return -1;
}

/** A place in the surface's frame, `height` m over it. */
export function onSurface(surface, u, v, height = 0) {
  const [a, b, n] = surface.axes;
  return [0, 1, 2].map((k) => surface.origin[k] + a[k] * u + b[k] * v + n[k] * height);
}

/** Somewhere inside: the middle of the largest triangle. */
export function middleOf(surface) {
  const { u, v, corners } = surface;
  let most = -1, best = [0, 0];
  for (let i = 0; i < corners.length; i += 3) {
    const [a, b, c] = corners.subarray(i, i + 3);
    const area = Math.abs((u[b] - u[a]) * (v[c] - v[a]) - (u[c] - u[a]) * (v[b] - v[a]));
    if (area > most) {
      most = area;
      best = [(u[a] + u[b] + u[c]) / 3, (v[a] + v[b] + v[c]) / 3];
    }
  }
  return onSurface(surface, ...best);
}

/** Angle to up in degrees: 0 a floor, 90 a wall, 180 a ceiling. */
export function slopeDeg(surface, up) {
  const [x, y, z] = surface.normal;
  const cosine = Math.min(1, Math.max(-1, x * up[0] + y * up[1] + z * up[2]));
  return Math.acos(cosine) * 180 / Math.PI;
}

/** Whole metres near the middle of what the map holds, so that coordinates about it are small. */
function originOf(json) {
  const places = json.surfaces.map((one) => [one.pose[3], one.pose[7], one.pose[11]]);
  if (json.voxels) places.push(json.voxels.low.map((cell) => cell * json.voxels.size));
  if (places.length === 0) return [0, 0, 0];
  return [0, 1, 2].map((k) => Math.round(places.reduce((sum, p) => sum + p[k], 0) / places.length));
}

/**
 * A foot's contact regions as the server gives them.
 * @param {object[]} answers of /api/regions/all
 */
export function footFrom(map, name, answers) {
  const regions = answers.map(({ surface: id, area_m2, refused, polygons }) => {
    const surface = map.surface(id);
    const flat = (ring) => {
      const places = ring.map((place) => minus(minus(place, map.origin), surface.origin));
      const along = (k) => places.map((p) => p.reduce((sum, x, i) => sum + x * surface.axes[k][i], 0));
      return { u: along(0), v: along(1) };
    };
    return { surface: id, area_m2, refused,
      polygons: surface ? polygons.map(({ outer, holes }) => [outer, ...holes].map(flat)) : [] };
  });
  return { name, regions };
}

function feetOf(json, arrays) {
  if (!json.feet) return [];
  const u = summed(arrays.region_u), v = summed(arrays.region_v);
  let at = 0;
  const ring = (size) => {
    const part = (all) => Array.from(all.subarray(at, at + size), (x) => x * json.ring_step_m);
    const result = { u: part(u), v: part(v) };
    at += size;
    return result;
  };
  return json.feet.map(({ name, regions }) => ({ name, regions: regions.map((one) =>
    ({ ...one, polygons: one.rings.map((sizes) => sizes.map(ring)) })) }));
}

/** A plan, as the block has it and the server gives it, in root coordinates. */
export function planFrom({ origin }, plan) {
  const here = (place) => minus(place, origin);
  const step = (one) => ({ ...one, at: here(one.at), outline: one.outline.map(here) });
  return { ...plan, start: plan.start.map(step), steps: plan.steps.map(step),
    body: plan.body.map(({ at }) => ({ at: here(at) })) };
}

/** @param {string} text of a block @param {number[]?} origin of the page, or its first map's */
export async function readMap(text, origin) {
  const { json, arrays } = await readTextBlock(text);
  origin ??= originOf(json);
  const surfaces = surfacesOf(json, arrays, origin);
  const map = {
    name: json.name, revision: json.revision, resolution: json.resolution, ownUp: json.up,
    suggestedUp: json.suggested_up ?? null, merged: json.merged, voxelsBeforeMerging: json.voxels_before_merging,
    changes: json.changes, origin, surfaces,
    cylinders: cylindersOf(json, origin),
    departedSurfaces: departures(json.departed_surfaces), departedCylinders: departures(json.departed_cylinders),
    feet: feetOf(json, arrays), feetLeftOut: json.feet_left_out,
    plans: (json.plans ?? []).map((plan) => planFrom({ origin }, plan)),
    voxels: voxelsOf(json, arrays, origin, surfaces.map(({ id }) => id)),
    slices: slicesOf(json, arrays),
    stairs: stairsOf(json, origin),
    sensor: null,
    toMap: (place) => place.map((x, k) => x + origin[k]),
  };
  orient(map, map.ownUp);
  map.surface = (id) => map.byId.get(id);
  map.cylinder = (id) => map.cylinders.find((one) => one.id === id);
  index(map);
  return map;
}

/** @param {object} map whose surfaces have changed: they are in order, and found by their ids */
function index(map) {
  map.surfaces.sort((a, b) => a.id - b.id);
  map.byId = new Map(map.surfaces.map((one) => [one.id, one]));
  map.coarseSurfaces = undefined;
}

const slicesOf = (json, arrays) => (json.slices
  ? { ...json.slices, rotation: json.R_upright_map, states: arrays.slice_states } : null);

const departures = (list) => list.map(([id, into, born, revision]) => ({ id, into, born, revision }));

const cylindersOf = (json, origin) =>
  json.cylinders.map((one) => ({ ...one, axis_point: minus(one.axis_point, origin) }));

const stairsOf = ({ stairs = [] }, origin) =>
  stairs.map((stair) => ({ ...stair, steps: stair.steps.map((step) =>
    ({ ...step, edge: step.edge.map((end) => minus(end, origin)) })) }));

/** The sensor whose scans make the map: its pose, row by row, and the places it came by. */
function sensorOf({ sensor }, arrays, origin) {
  if (!sensor) return null;
  const [x, y, z] = ['track_x', 'track_y', 'track_z'].map((name) => summed(arrays[name]));
  const track = Array.from(x, (_, i) => minus([x[i], y[i], z[i]].map((steps) => steps * sensor.step_m), origin));
  const T = sensor.pose;
  return { kind: sensor.kind, track, origin: minus([T[3], T[7], T[11]], origin),
    axes: [0, 1, 2].map((k) => [T[k], T[4 + k], T[8 + k]]) };
}

/** Brings a map up to date: a message of kind `changes` (src/io/page_changes.hpp). */
export function takeChanges(map, { json, arrays }) {
  const merged = (known, gone, now, whole) => {
    const replaced = new Set([...gone, ...now.map(({ id }) => id)]);
    return [...(whole ? [] : known.filter(({ id }) => !replaced.has(id))), ...now];
  };
  const whole = json.since === null;
  Object.assign(map, { name: json.name, revision: json.revision, resolution: json.resolution, ownUp: json.up,
    sensor: sensorOf(json, arrays, map.origin) });
  map.surfaces = merged(map.surfaces, json.gone ?? [], surfacesOf(json, arrays, map.origin), whole);
  map.cylinders = merged(map.cylinders, json.cylinders_gone ?? [], cylindersOf(json, map.origin), whole);
  map.stairs = stairsOf(json, map.origin);
  map.departedSurfaces = [...(whole ? [] : map.departedSurfaces), ...departures(json.departed_surfaces)];
  map.departedCylinders = [...(whole ? [] : map.departedCylinders), ...departures(json.departed_cylinders)];
  index(map);
}

/** Likewise one of kind `voxels`. */
export function takeVoxels(map, { json, arrays }) {
  map.voxels = voxelsOf(json, arrays, map.origin, json.surface_ids);
  map.slices = slicesOf(json, arrays) ?? map.slices;
  map.merged = json.merged;
  map.voxelsBeforeMerging = json.voxels_before_merging;
}
