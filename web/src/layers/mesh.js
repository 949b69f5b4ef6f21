// Triangles in their own colours, shaded by their normals.
import * as THREE from 'three';
import { shade } from '../shading.js';

const bytes = (color) => color.map((value) => Math.round(255 * Math.min(1, value)));

export class Triangles {
  positions = [];
  colors = [];
  corners = [];

  /** @param {object} map whose up the light comes from @param {number[]} corners of `places` */
  add(map, places, normal, color, corners) {
    const first = this.positions.length / 3, light = shade(map, normal), tint = bytes(color.map((x) => x * light));
    for (const place of places) {
      this.positions.push(...place);
      this.colors.push(...tint);
    }
    for (const corner of corners) this.corners.push(first + corner);
  }

  /** @param {boolean} cut what is seen from behind is left out */
  mesh({ cut = false, opacity = 1 } = {}) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(this.positions, 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(Uint8Array.from(this.colors), 3, true));
    geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(this.corners), 1));
    const material = new THREE.MeshBasicMaterial({
      vertexColors: true, side: cut ? THREE.FrontSide : THREE.DoubleSide, transparent: opacity < 1, opacity,
      // Lines and what is seen through lie in the plane of what they are on: they must win there.
      depthWrite: opacity === 1, polygonOffset: true, polygonOffsetFactor: opacity === 1 ? 2 : 1, polygonOffsetUnits: 1,
    });
    const object = new THREE.Mesh(geometry, material);
    object.frustumCulled = false;
    return object;
  }
}
