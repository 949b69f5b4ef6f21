// Lines some pixels wide: each a quad that the vertex shader lays along it. Not instanced: for four vertices an
// instance costs more than it saves, above all where there is no graphics card.
import * as THREE from 'three';

const vertexShader = `
  attribute vec2 corner;
  attribute vec3 to;
  attribute vec3 tint;
  attribute vec3 facing;
  uniform vec2 pixels;
  uniform float width;
  uniform vec3 eye;
  uniform bool cut;
  uniform float near;
  varying vec3 color;
  #include <clipping_planes_pars_vertex>
  void main() {
    color = tint;
    vec4 a = modelViewMatrix * vec4(position, 1.0);
    vec4 b = modelViewMatrix * vec4(to, 1.0);
    bool hidden = cut && dot(facing, facing) > 0.0 && dot(facing, eye - position) < 0.0;
    if (hidden || (a.z > -near && b.z > -near)) {
      gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
      return;
    }
    // The part before the camera; a little nearer than what the line lies on, in the same pixels.
    if (a.z > -near) a = mix(b, a, (b.z + near) / (b.z - a.z));
    if (b.z > -near) b = mix(a, b, (a.z + near) / (a.z - b.z));
    vec4 mvPosition = corner.x < 0.5 ? a : b;
    #include <clipping_planes_vertex>
    a.xyz *= 0.997;
    b.xyz *= 0.997;
    vec4 start = projectionMatrix * a, end = projectionMatrix * b;
    vec2 along = (end.xy / end.w - start.xy / start.w) * pixels;
    along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
    vec2 across = vec2(-along.y, along.x);
    gl_Position = corner.x < 0.5 ? start : end;
    // Half a line's width beyond its ends, so that corners are closed.
    vec2 shift = across * corner.y + along * (corner.x - 0.5);
    gl_Position.xy += shift * width / pixels * gl_Position.w;
  }
`;
const fragmentShader = `
  varying vec3 color;
  #include <clipping_planes_pars_fragment>
  void main() {
    #include <clipping_planes_fragment>
    gl_FragColor = vec4(color, 1.0);
  }
`;

/** Collects lines; null for `facing`: seen from everywhere. */
export class Lines {
  from = [];
  to = [];
  colors = [];
  facing = [];

  add(from, to, color, facing = null) {
    this.from.push(...from);
    this.to.push(...to);
    this.colors.push(...color.map((value) => Math.round(255 * value)), 255);
    this.facing.push(...(facing ?? [0, 0, 0]), 0);
  }
}

/** Each line's numbers for each of its four corners. */
function fourTimes(numbers, size, Type, scale = 1) {
  const result = new Type(4 * numbers.length);
  for (let i = 0; i < numbers.length; ++i) {
    const at = 4 * (i - i % size) + i % size;
    for (let corner = 0; corner < 4; ++corner) result[at + corner * size] = scale * numbers[i];
  }
  return result;
}

/**
 * @param {Lines} lines
 * @param {import('../context.js').Context} context
 * @param {number} width in pixels of the page
 */
export function ribbons(lines, context, width, cut = { value: false }) {
  const geometry = new THREE.BufferGeometry();
  const count = lines.from.length / 3;
  const corners = new Int8Array(8 * count), indices = new Uint32Array(6 * count);
  for (let i = 0; i < count; ++i) {
    corners.set([0, -1, 1, -1, 1, 1, 0, 1], 8 * i);
    indices.set([0, 1, 2, 0, 2, 3].map((k) => 4 * i + k), 6 * i);
  }
  const from = fourTimes(lines.from, 3, Float32Array);
  geometry.setAttribute('position', new THREE.BufferAttribute(from, 3));  // three.js asks for one of that name
  geometry.setAttribute('to', new THREE.BufferAttribute(fourTimes(lines.to, 3, Float32Array), 3));
  geometry.setAttribute('corner', new THREE.BufferAttribute(corners, 2));
  geometry.setAttribute('tint', new THREE.BufferAttribute(fourTimes(lines.colors, 4, Uint8Array), 4, true));
  geometry.setAttribute('facing', new THREE.BufferAttribute(fourTimes(lines.facing, 4, Int8Array, 127), 4, true));
  geometry.setIndex(new THREE.BufferAttribute(indices, 1));
  const material = new THREE.ShaderMaterial({
    vertexShader, fragmentShader, side: THREE.DoubleSide, clipping: true,
    uniforms: {
      pixels: { value: context.view.pixels }, eye: { value: context.eye }, cut,
      width: { value: width * context.view.renderer.getPixelRatio() },
      near: { value: 0.005 },
    },
  });
  const object = new THREE.Mesh(geometry, material);
  object.frustumCulled = false;
  return object;
}
