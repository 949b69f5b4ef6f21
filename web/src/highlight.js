// Marks of what the pointer is over, what was picked, and between what is measured.
import * as THREE from 'three';
import { Triangles } from './layers/mesh.js';
import { Lines } from './layers/lines.js';
import { patches } from './layers/surfaces.js';

const hoverColor = [1, 1, 1], pickColor = [1, 0.85, 0.1], measureColor = [0.9, 0.1, 0.6];

export function dispose(object) {
  object?.removeFromParent();
  object?.traverse((one) => {
    one.geometry?.dispose();
    one.material?.dispose();
  });
}

/** @param {import('./picking.js').Hit} hit */
function markOf(map, { kind, what }, color, strong) {
  const opacity = strong ? 0.45 : 0.3;
  if (kind === 'surface') return patches(map, [what], color, color, { opacity, width: strong ? 3.5 : 2 });
  if (kind === 'cylinder') {
    const triangles = new Triangles();
    triangles.addMantle(map, { ...what, radius_m: 1.03 * what.radius_m }, color);
    return triangles.mesh(opacity);
  }
  const { x, y, z, low, size } = map.voxels, lines = new Lines();
  const corners = new THREE.EdgesGeometry(new THREE.BoxGeometry(size, size, size)).attributes.position.array;
  const at = (corner) => [x, y, z].map((cells, k) => low[k] + (cells[what] + 0.5) * size + corners[3 * corner + k]);
  for (let i = 0; i < corners.length / 3; i += 2) lines.add(at(i), at(i + 1), color);
  return lines.object(strong ? 3 : 2);
}

export class Highlight {
  /** @param {import('./view.js').View} view */
  constructor(view) {
    this.view = view;
    this.marks = {};
  }

  set(name, object) {
    dispose(this.marks[name]);
    this.marks[name] = object;
    if (object) this.view.root.add(object);
    this.view.redraw();
  }

  hover(map, hit) { this.set('hover', hit && markOf(map, hit, hoverColor, false)); }
  picked(map, hit) { this.set('picked', hit && markOf(map, hit, pickColor, true)); }

  /** @param {number[][]} places none, one or two */
  measured(places) {
    if (places.length === 0) return this.set('measured', null);
    const lines = new Lines(), arm = 0.03;
    const cross = (place, k, by) => place.map((x, i) => (i === k ? x + by : x));
    for (const place of places)
      for (let k = 0; k < 3; ++k) lines.add(cross(place, k, -arm), cross(place, k, arm), measureColor);
    if (places.length === 2) lines.add(places[0], places[1], measureColor);
    const object = lines.object(2.5);
    object.material.depthTest = false;
    object.renderOrder = 1;
    return this.set('measured', object);
  }
}
