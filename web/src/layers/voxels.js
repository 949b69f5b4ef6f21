// Voxels: a point each, that the fragment shader makes a cube of by cutting the pixel's ray with it. A million of
// them are a million vertices, not twelve million triangles. They are ordered so that the first of them, drawn larger,
// are a coarser picture of all: that is what is shown while the camera moves and time is short.
import * as THREE from 'three';
import { ramp, rampCss, shadeGlsl } from '../shading.js';
import { heightOfOrigin } from '../up.js';

const pendingColor = [0.5, 0.5, 0.54];

const vertexShader = `
  attribute vec4 tint;
  uniform vec3 low;
  uniform float size, pixelsPerUnit, growth;
  varying vec3 center;
  varying vec3 color;
  #include <clipping_planes_pars_vertex>
  void main() {
    color = tint.rgb;
    center = low + (position + 0.5) * size;
    vec4 mvPosition = modelViewMatrix * vec4(center, 1.0);
    #include <clipping_planes_vertex>
    gl_Position = projectionMatrix * mvPosition;
    gl_PointSize = max(1.0, size * growth * pixelsPerUnit / max(1e-6, -mvPosition.z));
  }
`;
const fragmentShader = `
  uniform vec3 eye, light;
  uniform float size;
  uniform vec2 pixels;
  uniform mat4 rootOfClip;
  uniform bool cubes;
  varying vec3 center;
  varying vec3 color;
  ${shadeGlsl}
  #include <clipping_planes_pars_fragment>
  void main() {
    #include <clipping_planes_fragment>
    if (!cubes) {
      gl_FragColor = vec4(color, 1.0);
      return;
    }
    vec4 far = rootOfClip * vec4(2.0 * gl_FragCoord.xy / pixels - 1.0, 1.0, 1.0);
    vec3 inverse = 1.0 / (far.xyz / far.w - eye);
    vec3 one = (center - 0.5 * size - eye) * inverse, other = (center + 0.5 * size - eye) * inverse;
    vec3 enters = min(one, other), leaves = max(one, other);
    float enter = max(max(enters.x, enters.y), enters.z);
    if (enter > min(min(leaves.x, leaves.y), leaves.z)) discard;
    vec3 normal = enter == enters.x ? vec3(-sign(inverse.x), 0.0, 0.0)
                : enter == enters.y ? vec3(0.0, -sign(inverse.y), 0.0)
                                    : vec3(0.0, 0.0, -sign(inverse.z));
    gl_FragColor = vec4(color * shade(normal), 1.0);
  }
`;

const closing = 0.6;        // of a cell's edge: squares so large leave few gaps, and whole ones take thrice as long
const coarsest = 6;        // level: one voxel drawn for each 64³
const mostCells = 2 ** 28;  // that a level's table may have, in bits

/**
 * One voxel for each cell of 2^6 voxels' edge first, then one for each further cell of half that edge, and so on.
 * @param {function(number): boolean} wanted by a voxel's number
 * @returns {{order: Uint32Array, counts: number[]}} numbers; how many of them a picture of each level takes
 */
function byLevels(voxels, wanted) {
  const { x, y, z, count } = voxels, order = [], counts = [];
  const open = [];
  for (let i = 0; i < count; ++i) if (wanted(i)) open.push(i);
  let rest = Uint32Array.from(open);
  for (let level = coarsest; level > 0; --level) {
    const [nx, ny, nz] = voxels.cells.map((cells) => (cells >> level) + 1);
    if (nx * ny * nz <= mostCells) {
      const taken = new Uint8Array((nx * ny * nz >> 3) + 1);
      rest = rest.filter((i) => {
        const cell = ((z[i] >> level) * ny + (y[i] >> level)) * nx + (x[i] >> level), bit = 1 << (cell & 7);
        if (taken[cell >> 3] & bit) return true;
        taken[cell >> 3] |= bit;
        order.push(i);
        return false;
      });
    }
    counts[level] = order.length;
  }
  counts[0] = order.length + rest.length;
  const all = new Uint32Array(counts[0]);
  all.set(order);
  all.set(rest, order.length);
  return { order: all, counts };
}

function heights(map) {
  const { x, y, z, low, size, count } = map.voxels, [ux, uy, uz] = map.up;
  const base = ux * low[0] + uy * low[1] + uz * low[2];
  const height = (i) => base + size * (ux * (x[i] + 0.5) + uy * (y[i] + 0.5) + uz * (z[i] + 0.5));
  // Strays far off would leave one colour to the rest.
  const sample = Float64Array.from({ length: Math.min(count, 20000) }, (_, k) =>
    height(Math.floor(k * count / Math.min(count, 20000)))).sort();
  const quantile = (q) => sample[Math.floor(q * (sample.length - 1))];
  return { height, least: quantile(0.005), greatest: quantile(0.995) };
}

/** A function from a voxel's number to its colour. */
function coloringOf(map, choice) {
  const { voxels } = map;
  const table = Array.from({ length: 256 }, (_, i) => ramp(i / 255).map((value) => Math.round(255 * value)));
  const byShare = (share) => table[Math.min(255, Math.max(0, Math.round(255 * share)))];
  if (choice === 'surface') {
    const bytes = (color) => color.map((value) => Math.round(255 * value));
    const own = new Map(map.surfaces.map(({ id, color }) => [id, bytes(color)])), none = bytes(pendingColor);
    return (i) => own.get(voxels.surface[i]) ?? none;
  }
  if (choice === 'log_odds') {
    const { leastLogOdds: least, greatestLogOdds: greatest } = voxels;
    return (i) => byShare((voxels.logOdds(i) - least) / Math.max(1e-9, greatest - least));
  }
  const { height, least, greatest } = heights(map);
  return (i) => byShare((height(i) - least) / Math.max(1e-9, greatest - least));
}

function points(map, context, order, colorOf) {
  const { voxels } = map;
  const cells = new Uint16Array(4 * order.length), colors = new Uint8Array(4 * order.length);
  order.forEach((voxel, i) => {
    cells[4 * i] = voxels.x[voxel];
    cells[4 * i + 1] = voxels.y[voxel];
    cells[4 * i + 2] = voxels.z[voxel];
    const color = colorOf(voxel);
    colors[4 * i] = color[0];
    colors[4 * i + 1] = color[1];
    colors[4 * i + 2] = color[2];
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(cells, 4));  // a fourth, so that each begins at 4 n bytes
  geometry.setAttribute('tint', new THREE.BufferAttribute(colors, 4, true));
  const material = new THREE.ShaderMaterial({
    vertexShader, fragmentShader, clipping: true,
    uniforms: {
      low: { value: new THREE.Vector3(...voxels.low) }, size: { value: voxels.size },
      eye: { value: context.eye }, light: { value: context.light }, pixels: { value: context.view.pixels },
      pixelsPerUnit: { value: 1 }, growth: { value: 1 }, cubes: { value: false },
      rootOfClip: { value: new THREE.Matrix4() },
    },
  });
  const object = new THREE.Points(geometry, material);
  object.frustumCulled = false;
  return object;
}

/** Sets the finest level that costs no more than is allowed. @returns {number} the level, 0 the whole */
function chooseLevel(object, view, counts, allowed) {
  let level = 0;
  while (level < coarsest && counts[level] > allowed) ++level;
  object.material.uniforms.pixelsPerUnit.value = view.pixels.y / 2 * view.camera.projectionMatrix.elements[5];
  object.geometry.setDrawRange(0, counts[level]);
  return level;
}

function drawCubes(object, view, counts, allowed) {
  const level = chooseLevel(object, view, counts, allowed), { uniforms } = object.material;
  uniforms.rootOfClip.value.copy(view.root.matrixWorld).invert().multiply(view.camera.matrixWorld)
    .multiply(view.camera.projectionMatrixInverse);
  uniforms.cubes.value = level === 0;
  uniforms.growth.value = level === 0 ? Math.sqrt(3) : closing * 2 ** level;
  return { cost: counts[level], whole: level === 0 };
}

export const voxels = {
  id: 'voxels', label: 'Voxels', on: false,
  count: (map) => map.voxels?.count ?? 0,
  choices: () => [{ id: 'height', label: 'by height' }, { id: 'log_odds', label: 'by log-odds' },
    { id: 'surface', label: 'by surface' }],
  create(map, context) {
    const colorOf = coloringOf(map, context.settings.choice.voxels);
    const { order, counts } = byLevels(map.voxels, () => true);
    const object = points(map, context, order, colorOf);
    object.userData.draw = (allowed) => drawCubes(object, context.view, counts, allowed);
    return object;
  },
  legend(map, context) {
    const { choice } = context.settings;
    if (choice.voxels === 'surface') return [{ color: pendingColor, text: 'voxel of no surface yet' }];
    if (choice.voxels === 'log_odds') {
      const { leastLogOdds: least, greatestLogOdds: greatest } = map.voxels;
      return [{ ramp: rampCss, low: `log-odds ${least.toFixed(2)}`, high: greatest.toFixed(2) }];
    }
    const { least, greatest } = heights(map);
    const base = heightOfOrigin(map);
    return [{ ramp: rampCss, low: `height ${(least + base).toFixed(2)} m`, high: `${(greatest + base).toFixed(2)} m` }];
  },
};

export const pending = {
  id: 'pending', label: 'Pending points', on: false,
  count: (map) => (map.voxels ? map.voxels.surface.reduce((sum, one) => sum + (one === 0), 0) : 0),
  create(map, context) {
    const { order, counts } = byLevels(map.voxels, (i) => map.voxels.surface[i] === 0);
    const color = pendingColor.map((value) => Math.round(255 * value));
    const object = points(map, context, order, () => color);
    const growth = 0.4;  // smaller than voxels: one sees what is behind them
    object.userData.draw = (allowed) => {
      const level = chooseLevel(object, context.view, counts, allowed);
      object.material.uniforms.growth.value = growth * 2 ** level;
      return { cost: counts[level], whole: level === 0 };
    };
    return object;
  },
  legend: () => [{ color: pendingColor, text: 'pending: a point of no surface yet' }],
};
