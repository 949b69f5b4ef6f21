// The map's surfaces as octosurf export writes them (docs/formats.md), as far as the page has them.
import { edgeKinds, noLabel, onSurface } from './data.js';

const tidy = (place) => place.map((x) => Math.round(1e9 * x) / 1e9);

function polygonsOf(map, surface) {
  const polygons = [];
  for (const { from, to, outer } of surface.rings) {
    const ring = [], edges = [];
    for (let k = from; k < to; ++k) {
      ring.push(tidy(map.toMap(onSurface(surface, surface.u[k], surface.v[k]))));
      edges.push(edgeKinds[surface.edges[k]]);
    }
    const labelled = surface.edges[from] !== noLabel;
    if (outer) polygons.push({ outer: ring, holes: [], ...(labelled && { outer_edges: edges, hole_edges: [] }) });
    else {
      polygons.at(-1).holes.push(ring);
      if (labelled) polygons.at(-1).hole_edges.push(edges);
    }
  }
  return polygons;
}

function surfaceJson(map, surface) {
  const { id, color, normal, offset, area_m2, inliers, rms_m, covariance, normal_std_deg, offset_std_m, revision,
    parents } = surface;
  return { id, color, plane: { normal, offset }, T_map_surface: surface.pose, area_m2, inliers, rms_m,
    covariance, normal_std_deg, offset_std_m, revision, parents, polygons: polygonsOf(map, surface) };
}

function cylinderJson(map, cylinder) {
  const { id, axis_point: point, axis, radius_m, length_m, span_rad: span, start, inliers, rms_m, revision } = cylinder;
  return { id, axis_point: tidy(map.toMap(point)), axis, radius_m, length_m, span_deg: span * 180 / Math.PI, start,
    inliers, rms_m, revision };
}

/** @returns {string} a surface a line */
export function surfacesJson(map) {
  const lines = (all) => (all.length === 0 ? '' : `\n${all.map((one) => JSON.stringify(one)).join(',\n')}\n`);
  const { resolution, revision } = map;
  const head = JSON.stringify({ format: 'octosurf-surfaces', version: 1, resolution, revision });
  return `${head.slice(0, -1)},"surfaces":[${lines(map.surfaces.map((one) => surfaceJson(map, one)))}],"cylinders":[${
    lines(map.cylinders.map((one) => cylinderJson(map, one)))}]}\n`;
}
