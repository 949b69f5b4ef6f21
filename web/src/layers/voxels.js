// Voxels: a point each, that the fragment shader makes a cube of by cutting the pixel's ray with it. A million of
// them are a million vertices, not twelve million triangles. They are shuffled so that the first of them, drawn larger,
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
  void main() {
    color = tint.rgb;
    center = low + (position + 0.5) * size;
    vec4 mvPosition = modelViewMatrix * vec4(center, 1.0);
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

const closing = 0.8;  // of the edge that would fill a surface: squares so large leave few gaps

/** The numbers of the voxels, the same shuffle each time. */
function shuffled(count) {
  const order = Uint32Array.from({ length: count }, (_, i) => i);
  for (let i = count - 1, state = 1; i > 0; --i) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    const other = Math.floor(state / 2 ** 32 * (i + 1));
    [order[i], order[other]] = [order[other], order[i]];
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

/** @param {function(number): number[]} colorOf a voxel's number */
function points(map, view, colorOf) {
  const { voxels } = map, { count } = voxels, order = shuffled(count);
  const cells = new Uint16Array(4 * count), colors = new Uint8Array(4 * count);
  order.forEach((voxel, i) => {
    cells.set([voxels.x[voxel], voxels.y[voxel], voxels.z[voxel]], 4 * i);
    colors.set(colorOf(voxel), 4 * i);
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(cells, 4));  // a fourth, so that each begins at 4 n bytes
  geometry.setAttribute('tint', new THREE.BufferAttribute(colors, 4, true));
  const uniforms = {
    low: { value: new THREE.Vector3(...voxels.low) }, size: { value: voxels.size }, eye: { value: new THREE.Vector3() },
    light: { value: new THREE.Vector3(...map.light) }, pixels: { value: view.pixels }, pixelsPerUnit: { value: 1 },
    growth: { value: 1 }, cubes: { value: false }, rootOfClip: { value: new THREE.Matrix4() },
  };
  const object = new THREE.Points(geometry, new THREE.ShaderMaterial({ vertexShader, fragmentShader, uniforms }));
  object.frustumCulled = false;
  object.userData.draw = (allowed) => {
    const drawn = Math.min(count, Math.ceil(allowed)), whole = drawn === count;
    uniforms.eye.value.copy(view.eye);
    uniforms.pixelsPerUnit.value = view.pixels.y / 2 * view.camera.projectionMatrix.elements[5];
    uniforms.rootOfClip.value.copy(view.root.matrixWorld).invert().multiply(view.camera.matrixWorld)
      .multiply(view.camera.projectionMatrixInverse);
    uniforms.cubes.value = whole;
    uniforms.growth.value = whole ? Math.sqrt(3) : closing * Math.sqrt(count / drawn);
    geometry.setDrawRange(0, drawn);
    return { cost: drawn, whole };
  };
  return object;
}

export const voxels = {
  id: 'voxels', label: 'Voxels', on: false,
  has: (map) => map.voxels !== null,
  count: (map) => map.voxels.count,
  choices: () => [{ id: 'height', label: 'by height' }, { id: 'log_odds', label: 'by log-odds' },
    { id: 'surface', label: 'by surface' }],
  create: (map, { view, settings }) => points(map, view, coloringOf(map, settings.choice.voxels)),
  legend(map, { choice }) {
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
