// For orientation: a grid of 1 m at the height of the lowest surfaces, and the map frame's axes.
import * as THREE from 'three';
import { Lines, ribbons } from './ribbons.js';

const mostLines = 200;
const axisLength = 0.5;  // m

export const grid = {
  id: 'grid', label: 'Grid', on: true,
  create(map, context) {
    const { min, max } = context.extent;  // upright
    let step = 1;
    while ((max.x - min.x + max.y - min.y) / step > mostLines) step *= 10;
    const rotation = new THREE.Quaternion(...map.rotation);
    const base = new THREE.Vector3(...map.origin).applyQuaternion(rotation);  // lines at whole metres of the map
    const back = rotation.clone().invert();
    const at = (x, y) => new THREE.Vector3(x, y, min.z - 0.005).applyQuaternion(back).toArray();
    const [x0, x1, y0, y1] = [
      Math.floor((min.x + base.x) / step - 1) * step - base.x, Math.ceil((max.x + base.x) / step + 1) * step - base.x,
      Math.floor((min.y + base.y) / step - 1) * step - base.y, Math.ceil((max.y + base.y) / step + 1) * step - base.y,
    ];
    const lines = new Lines(), color = context.gridColor();
    for (let x = x0; x < x1 + step / 2; x += step) lines.add(at(x, y0), at(x, y1), color);
    for (let y = y0; y < y1 + step / 2; y += step) lines.add(at(x0, y), at(x1, y), color);
    context.gridStep = step;
    const object = ribbons(lines, context, 0.6);
    object.material.clipping = false;
    return object;
  },
  legend: (map, context) => [{ line: context.gridColor(), text: `${context.gridStep ?? 1} m` }],
};

export const axes = {
  id: 'axes', label: 'Map frame', on: false,
  create(map, context) {
    const lines = new Lines(), zero = map.origin.map((x) => -x);
    for (let k = 0; k < 3; ++k) {
      const color = [0.15, 0.15, 0.15], tip = [...zero];
      color[k] = 0.9;
      tip[k] += axisLength;
      lines.add(zero, tip, color);
    }
    return ribbons(lines, context, 2.5);
  },
  legend: () => [{ line: [0.9, 0.15, 0.15], text: 'x' }, { line: [0.15, 0.9, 0.15], text: 'y' },
    { line: [0.15, 0.15, 0.9], text: 'z, 0.5 m each' }],
};
