// Triangles in their own colours, shaded by their normals.
import * as THREE from 'three';
import { light, shadeGlsl } from '../shading.js';

const vertexShader = `
  attribute vec3 tint;
  uniform vec3 light;  // in the mesh's own frame
  uniform vec3 eye;
  uniform bool cut;
  varying vec3 color;
  ${shadeGlsl}
  #include <clipping_planes_pars_vertex>
  void main() {
    vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
    #include <clipping_planes_vertex>
    float side = dot(normal, eye - position) < 0.0 ? -1.0 : 1.0;
    color = tint * shade(side * normal);
    gl_Position = projectionMatrix * mvPosition;
    // What is seen from behind is left out whole: a plane shows its vertices all from the same side.
    if (cut && side < 0.0) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }
`;
const fragmentShader = `
  uniform float opacity;
  varying vec3 color;
  #include <clipping_planes_pars_fragment>
  void main() {
    #include <clipping_planes_fragment>
    gl_FragColor = vec4(color, opacity);
  }
`;

/**
 * @param {{positions: Float32Array, normals: Float32Array, colors: Uint8Array, indices: Uint32Array}} parts
 * @param {{eye: THREE.Vector3, light: THREE.Vector3, cut: {value: boolean}, opacity?: number}} look
 */
export function mesh(parts, { eye, light: lightHere, cut, opacity = 1 }) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(parts.positions, 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(parts.normals, 3));
  geometry.setAttribute('tint', new THREE.BufferAttribute(parts.colors, 3, true));
  geometry.setIndex(new THREE.BufferAttribute(parts.indices, 1));
  const material = new THREE.ShaderMaterial({
    vertexShader, fragmentShader, side: THREE.DoubleSide, clipping: true,
    transparent: opacity < 1, depthWrite: opacity === 1,
    uniforms: { light: { value: lightHere }, eye: { value: eye }, cut, opacity: { value: opacity } },
  });
  const object = new THREE.Mesh(geometry, material);
  object.frustumCulled = false;
  return object;
}

/** The light in a map's frame, given the rotation to upright. */
export function lightIn(rotation) {
  return light.clone().applyQuaternion(new THREE.Quaternion(...rotation).invert());
}
