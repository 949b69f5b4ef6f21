// Voxels: a point each, that the fragment shader makes a cube of by cutting the pixel's ray with it. A million of
// them are a million vertices, not twelve million triangles. They are drawn in random order, so that a part of them,
// drawn larger, is a coarser picture of all: that is what is shown while the camera moves and time is short.
import * as THREE from 'three';
import { ramp, rampCss, shadeGlsl } from '../shading.js';

const pendingColor = [0.5, 0.5, 0.54];

const vertexShader = `
  attribute vec4 tint;
  uniform vec3 low;
  uniform float size, pixelsPerUnit, growth;
  varying vec3 center;
  varying vec3 color;
  void main() {
    color = tint.rgb;
    center = low + (position + 0.5) * size;
    vec4 place = modelViewMatrix * vec4(center, 1.0);
    gl_Position = projectionMatrix * place;
    gl_PointSize = max(1.0, size * growth * pixelsPerUnit / max(1e-6, -place.z));
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
  void main() {
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

const smoothFrameMs = 33, quickFrameMs = 20;
const fewest = 5000;
const firstPart = 400000;  // voxels drawn in the first moving frame; the frames' times set it from then on

/** The same order every time. */
function shuffled(count) {
  const order = new Uint32Array(count);
  let state = 1;
  for (let i = 0; i < count; ++i) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    const j = Math.floor(state / 2 ** 32 * (i + 1));
    order[i] = order[j];
    order[j] = i;
  }
  return order;
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
    const own = [pendingColor, ...map.surfaces.map((one) => one.color)]
      .map((color) => color.map((value) => Math.round(255 * value)));
    return (i) => own[voxels.surface[i]];
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
    vertexShader, fragmentShader,
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

const budgets = { voxels: firstPart, pending: firstPart };  // kept from map to map: they are the machine's

/**
 * How many of the points are drawn in the picture that comes: all, or while the camera moves as many as frames of
 * 33 ms have time for.
 * @returns {number} that share of all
 */
function prepare(object, view, kind, moving, frameMs) {
  const { camera } = view, count = object.geometry.attributes.position.count;
  object.material.uniforms.pixelsPerUnit.value = view.pixels.y / 2 * camera.projectionMatrix.elements[5];
  if (moving && frameMs > smoothFrameMs) budgets[kind] *= Math.max(0.4, smoothFrameMs / frameMs);
  if (moving && frameMs > 0 && frameMs < quickFrameMs) budgets[kind] *= 1.25;
  budgets[kind] = Math.min(Math.max(budgets[kind], fewest), count);
  const part = moving ? budgets[kind] / Math.max(1, count) : 1;
  object.geometry.setDrawRange(0, Math.round(part * count));
  object.userData.drawn = Math.round(part * count);
  return part;
}

function prepareCubes(object, view, moving, frameMs) {
  const part = prepare(object, view, 'voxels', moving, frameMs), { uniforms } = object.material;
  uniforms.rootOfClip.value.copy(view.root.matrixWorld).invert().multiply(view.camera.matrixWorld)
    .multiply(view.camera.projectionMatrixInverse);
  uniforms.cubes.value = part === 1;
  uniforms.growth.value = part === 1 ? Math.sqrt(3) : Math.min(4, 1.1 / Math.sqrt(part));
}

export const voxels = {
  id: 'voxels', label: 'Voxels', on: false,
  count: (map) => map.voxels?.count ?? 0,
  choices: () => [{ id: 'height', label: 'by height' }, { id: 'log_odds', label: 'by log-odds' },
    { id: 'surface', label: 'by surface' }],
  create(map, context) {
    const colorOf = coloringOf(map, context.settings.choice.voxels);
    const object = points(map, context, shuffled(map.voxels.count), colorOf);
    object.userData.prepare = (moving, frameMs) => prepareCubes(object, context.view, moving, frameMs);
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
    const base = map.origin.reduce((sum, x, k) => sum + x * map.up[k], 0);
    return [{ ramp: rampCss, low: `height ${(least + base).toFixed(2)} m`, high: `${(greatest + base).toFixed(2)} m` }];
  },
};

export const pending = {
  id: 'pending', label: 'Pending points', on: true,
  count: (map) => (map.voxels ? map.voxels.surface.reduce((sum, one) => sum + (one === 0), 0) : 0),
  create(map, context) {
    const order = shuffled(map.voxels.count).filter((i) => map.voxels.surface[i] === 0);
    const color = pendingColor.map((value) => Math.round(255 * value));
    const object = points(map, context, order, () => color);
    const growth = 0.4;  // smaller than voxels: one sees what is behind them
    object.userData.prepare = (moving, frameMs) => {
      const part = prepare(object, context.view, 'pending', moving, frameMs);
      object.material.uniforms.growth.value = growth / Math.sqrt(part);
    };
    return object;
  },
  legend: () => [{ color: pendingColor, text: 'pending: a point of no surface yet' }],
};
