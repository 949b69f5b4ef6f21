// Surfaces with fewer vertices, for pictures that have to be drawn soon.
import { ShapeUtils, Vector2 } from 'three';

/**
 * The vertices of a ring that stay: none that goes lies farther than `tolerance` from the line in its place (Douglas
 * and Peucker 1973). At least three.
 */
function kept(u, v, { from, to }, tolerance) {
  const off = (i, a, b) => {
    const x = u[b] - u[a], y = v[b] - v[a], length = Math.hypot(x, y);
    const [p, q] = [u[i] - u[a], v[i] - v[a]];
    return length < 1e-9 ? Math.hypot(p, q) : Math.abs(x * q - y * p) / length;
  };
  const farthest = (first, last, a, b) => {
    let best = first, distance = -1;
    for (let i = first; i < last; ++i) {
      const here = off(i, a, b);
      if (here > distance) [best, distance] = [i, here];
    }
    return { best, distance };
  };
  const half = farthest(from + 1, to, from, from).best;
  const stays = new Set([from, half]), open = [[from, half, half], [half, to, from]];
  while (open.length > 0) {
    const [a, last, b] = open.pop();
    if (last - a < 2) continue;
    const { best, distance } = farthest(a + 1, last, a, b);
    if (distance <= tolerance) continue;
    stays.add(best);
    open.push([a, best, best], [best, last, b]);
  }
  if (stays.size === 2) {
    const { best } = farthest(from + 1, to, from, half);
    stays.add(best);
  }
  return [...stays].sort((a, b) => a - b);
}

function extent(u, v, { from, to }) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = from; i < to; ++i) {
    box[0] = Math.min(box[0], u[i]);
    box[1] = Math.min(box[1], v[i]);
    box[2] = Math.max(box[2], u[i]);
    box[3] = Math.max(box[3], v[i]);
  }
  return Math.max(box[2] - box[0], box[3] - box[1]);
}

/** The same surface, roughly: what is smaller than the tolerance is left out, edges have the kind of their first part. */
export function coarse(surface, tolerance) {
  const u = [], v = [], edges = [], rings = [], corners = [];
  let contour = null, holes = [], first = 0;
  const finish = () => {
    if (!contour) return;
    for (const corner of ShapeUtils.triangulateShape(contour, holes)) corners.push(...corner.map((i) => first + i));
    contour = null;
  };
  for (const ring of surface.rings) {
    if (ring.outer) finish();
    if (extent(surface.u, surface.v, ring) < tolerance || (!ring.outer && !contour)) continue;
    const vertices = kept(surface.u, surface.v, ring, tolerance);
    const points = vertices.map((i) => new Vector2(surface.u[i], surface.v[i]));
    if (ring.outer) [contour, holes, first] = [points, [], u.length];
    else holes.push(points);
    rings.push({ from: u.length, to: u.length + vertices.length, outer: ring.outer });
    for (const i of vertices) {
      u.push(surface.u[i]);
      v.push(surface.v[i]);
      edges.push(surface.edges[i]);
    }
  }
  finish();
  return { ...surface, u, v, edges, rings, corners };
}

/** Tolerances of the levels in d, the whole first. */
const tolerances = [0, 2, 8, 32];
export const levelCount = tolerances.length;

/** A map's surfaces at a level; worked out once for each. */
export function surfacesAt(map, level) {
  map.coarseSurfaces ??= [map.surfaces];
  map.coarseSurfaces[level] ??= map.surfaces.map((one) => coarse(one, tolerances[level] * map.resolution));
  return map.coarseSurfaces[level];
}
