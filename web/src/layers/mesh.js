// Triangles in their own colours, shaded by their normals, seen from where the normals point to.
import * as THREE from 'three';
import { shade } from '../shading.js';
import { cross } from '../vectors.js';

const facetRad = Math.PI / 24;

export class Triangles {
  positions = [];
  colors = [];
  corners = [];

  /** @param {object} map whose up the light comes from @param {number[]} corners of `places`, counter-clockwise */
  add(map, places, normal, color, corners) {
    const first = this.positions.length / 3, light = shade(map, normal);
    const tint = color.map((value) => Math.round(255 * Math.min(1, value * light)));
    for (const place of places) {
      this.positions.push(...place);
      this.colors.push(...tint);
    }
    for (const corner of corners) this.corners.push(first + corner);
  }

  /** The part of a cylinder's lateral surface that was seen. */
  addMantle(map, { axis_point: middle, axis, radius_m: radius, length_m: length, start, span_deg: spanDeg }, color) {
    const span = spanDeg * Math.PI / 180, count = Math.max(1, Math.ceil(span / facetRad)), side = cross(axis, start);
    const outward = (i) => start.map((x, k) => Math.cos(span * i / count) * x + Math.sin(span * i / count) * side[k]);
    for (let i = 0; i < count; ++i) {
      const places = [outward(i), outward(i + 1)].flatMap((out) => [-0.5, 0.5].map((end) =>
        middle.map((x, k) => x + radius * out[k] + end * length * axis[k])));
      this.add(map, places, outward(i + 0.5), color, [0, 2, 1, 1, 2, 3]);
    }
  }

  mesh(opacity = 1) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(this.positions, 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(Uint8Array.from(this.colors), 3, true));
    geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(this.corners), 1));
    const material = new THREE.MeshBasicMaterial({
      vertexColors: true, transparent: opacity < 1, opacity,
      // Lines and what is seen through lie in the plane of what they are on: they must win there.
      depthWrite: opacity === 1, polygonOffset: true, polygonOffsetFactor: opacity === 1 ? 2 : 1,
      polygonOffsetUnits: opacity === 1 ? 8 : 1,
    });
    const object = new THREE.Mesh(geometry, material);
    object.frustumCulled = false;
    return object;
  }
}
