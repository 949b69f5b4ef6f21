// Marks of what the pointer is over, what was picked, and between what is measured.
import * as THREE from 'three';
import { lightIn, mesh } from './layers/mesh.js';
import { ribbons, Lines } from './layers/ribbons.js';
import { linesOf } from './layers/edges.js';
import { mantleOf } from './layers/cylinders.js';
import { trianglesOf } from './layers/surfaces.js';

const hoverColor = [1, 1, 1], pickColor = [1, 0.85, 0.1], measureColor = [0.9, 0.1, 0.6];

export function dispose(object) {
  object?.removeFromParent();
  object?.traverse((one) => {
    one.geometry?.dispose();
    one.material?.map?.dispose();
    one.material?.dispose();
  });
}

function cubeLines(voxels, i, color) {
  const lines = new Lines(), { size } = voxels;
  const low = [voxels.x[i], voxels.y[i], voxels.z[i]].map((cell, k) => voxels.low[k] + cell * size);
  for (let axis = 0; axis < 3; ++axis) {
    for (const [a, b] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
      const from = [...low];
      from[(axis + 1) % 3] += a * size;
      from[(axis + 2) % 3] += b * size;
      const to = [...from];
      to[axis] += size;
      lines.add(from, to, color);
    }
  }
  return lines;
}

/** @param {import('./picking.js').Hit?} hit */
function markOf(map, hit, context, color, strong) {
  const group = new THREE.Group(), cut = { value: false };
  const look = { ...context, cut, opacity: strong ? 0.45 : 0.3, light: lightIn(map.rotation) };
  if (hit.kind === 'surface') {
    group.add(mesh(trianglesOf([hit.what], () => color), look));
    group.add(ribbons(linesOf([hit.what], () => color), context, strong ? 3.5 : 2, cut));
    // In the plane of what it marks: it must win there.
    group.children[0].material.polygonOffset = true;
    group.children[0].material.polygonOffsetFactor = -2;
    group.children[0].material.polygonOffsetUnits = -2;
  } else if (hit.kind === 'cylinder') {
    group.add(mesh(mantleOf([{ ...hit.what, radius_m: 1.03 * hit.what.radius_m }]), look));
  } else {
    group.add(ribbons(cubeLines(map.voxels, hit.what, color), context, strong ? 3 : 2));
  }
  return group;
}

export class Highlight {
  /** @param {import('./context.js').Context} context */
  constructor(context) {
    this.context = context;
    this.marks = {};
  }

  set(name, object) {
    dispose(this.marks[name]);
    this.marks[name] = object;
    if (object) this.context.view.root.add(object);
    this.context.view.redraw();
  }

  hover(map, hit) { this.set('hover', hit && markOf(map, hit, this.context, hoverColor, false)); }
  picked(map, hit) { this.set('picked', hit && markOf(map, hit, this.context, pickColor, true)); }

  /** @param {number[][]} places none, one or two */
  measured(places) {
    if (places.length === 0) return this.set('measured', null);
    const lines = new Lines(), arm = 0.03;
    for (const place of places) {
      for (let k = 0; k < 3; ++k) {
        const [from, to] = [[...place], [...place]];
        from[k] -= arm;
        to[k] += arm;
        lines.add(from, to, measureColor);
      }
    }
    if (places.length === 2) lines.add(places[0], places[1], measureColor);
    const object = ribbons(lines, this.context, 2.5);
    object.material.depthTest = false;
    object.renderOrder = 1;
    return this.set('measured', object);
  }
}
