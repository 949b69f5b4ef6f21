// A map as the page's parts use it, made of the messages of src/io/exporters/page_messages.hpp: those that stand in the
// page, and those that the server sends. Positions are in the map frame less `origin` (32-bit floats are too coarse far
// from zero); `toMap` brings them back for whoever reads them.
import { ShapeUtils, Vector2 } from 'three';
import { summed } from './block.js';
import { orient } from './up.js';
import { dot, minus } from './vectors.js';

/**
 * @typedef {object} Surface   its fields as octosurf export writes them (docs/formats.md), and
 * @property {number[]} origin     of its frame
 * @property {number[][]} axes     u, v, normal of its frame
 * @property {Float64Array} u      of all rings' vertices
 * @property {Float64Array} v
 * @property {{from: number, to: number}[]} rings   vertices of each
 * @property {Uint32Array} corners   three vertices a triangle
 *
 * @typedef {object} Voxels
 * @property {number} count
 * @property {number} size         edge, m
 * @property {number[]} low        corner of the grid's first cell
 * @property {Uint16Array} x  @property {Uint16Array} y  @property {Uint16Array} z
 * @property {Uint32Array} surface   id; 0: pending
 * @property {function(number): number} logOdds
 */

/** A surface's polygons as they are exported. */
function outlineOf(map, { origin, axes }, polygons) {
  const u = [], v = [], rings = [], corners = [];
  const add = (ring) => {
    const points = ring.map((place) => {
      const at = minus(minus(place, map.origin), origin);
      return new Vector2(dot(at, axes[0]), dot(at, axes[1]));
    });
    rings.push({ from: u.length, to: u.length + points.length });
    for (const point of points) {
      u.push(point.x);
      v.push(point.y);
    }
    return points;
  };
  for (const { outer, holes } of polygons) {
    const first = u.length, contour = add(outer), inner = holes.map(add);
    for (const corner of ShapeUtils.triangulateShape(contour, inner)) corners.push(...corner.map((i) => first + i));
  }
  return { u: Float64Array.from(u), v: Float64Array.from(v), rings, corners: Uint32Array.from(corners) };
}

function surfaceOf(map, exported) {
  const T = exported.T_map_surface;  // row by row
  const frame = { origin: minus([T[3], T[7], T[11]], map.origin), axes: [0, 1, 2].map((k) => [T[k], T[4 + k], T[8 + k]]) };
  return { ...exported, ...exported.plane, ...frame, ...outlineOf(map, frame, exported.polygons) };
}

const cylinderOf = (map, exported) => ({ ...exported, axis_point: minus(exported.axis_point, map.origin) });

/** A place in the surface's frame. */
export function onSurface(surface, u, v) {
  const [a, b] = surface.axes;
  return [0, 1, 2].map((k) => surface.origin[k] + a[k] * u + b[k] * v);
}

/** Angle to up in degrees: 0 a floor, 90 a wall, 180 a ceiling. */
export const slopeDeg = (surface, up) =>
  Math.acos(Math.min(1, Math.max(-1, dot(surface.normal, up)))) * 180 / Math.PI;

/** Whole metres near the middle of the surfaces, so that coordinates about it are small. */
function originOf(surfaces) {
  const places = surfaces.map(({ T_map_surface: T }) => [T[3], T[7], T[11]]);
  return [0, 1, 2].map((k) => Math.round(places.reduce((sum, p) => sum + p[k], 0) / Math.max(1, places.length)));
}

/** A map of which nothing is known yet. */
export function newMap() {
  const map = { surfaces: [], cylinders: [], voxels: null };
  map.toMap = (place) => place.map((x, k) => x + map.origin[k]);
  map.surface = (id) => map.surfaces.find((one) => one.id === id);
  map.cylinder = (id) => map.cylinders.find((one) => one.id === id);
  return map;
}

/** What is known and has not gone or come anew, and what comes. */
function merged(known, gone, now) {
  const replaced = new Set([...gone, ...now.map(({ id }) => id)]);
  return [...known.filter(({ id }) => !replaced.has(id)), ...now].sort((a, b) => a.id - b.id);
}

/** Takes a message of kind `surfaces` over into a map: everything, or what has changed since a revision. */
export function takeSurfaces(map, { json }) {
  const { surfaces, cylinders, stairs = [], resolution, revision } = json.now;
  map.origin ??= originOf(surfaces);
  if (json.since === null) Object.assign(map, { surfaces: [], cylinders: [] });
  const gone = [...json.gone, ...json.merged.map(({ id }) => id)];
  const here = (place) => minus(place, map.origin);
  Object.assign(map, {
    name: json.name, resolution, revision, ownUp: json.up,
    surfaces: merged(map.surfaces, gone, surfaces.map((one) => surfaceOf(map, one))),
    cylinders: merged(map.cylinders, json.cylinders_gone, cylinders.map((one) => cylinderOf(map, one))),
    stairs: stairs.map((stair) => ({ ...stair, steps: stair.steps.map((step) => ({ ...step, edge: step.edge.map(here) })) })),
  });
  orient(map, map.up ?? map.ownUp);
}

/** Likewise one of kind `voxels`. */
export function takeVoxels(map, { json, arrays }) {
  Object.assign(map, { voxels: null, merged: json.merged, voxelsBeforeMerging: json.voxels_before_merging });
  if (!json.voxels) return;
  const { size, low, least_log_odds: least, log_odds_step: step } = json.voxels;
  const [x, y, z] = ['x', 'y', 'z'].map((axis) => summed(arrays[`voxel_${axis}`]));
  map.voxels = {
    count: x.length, size, x, y, z, low: minus(low.map((cell) => cell * size), map.origin),
    surface: arrays.voxel_surface,
    logOdds: (i) => least + step * arrays.voxel_log_odds[i],
    leastLogOdds: least, greatestLogOdds: least + 255 * step,
  };
}
