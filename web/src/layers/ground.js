// For orientation: a grid of 1 m at the height of the lowest surfaces, and the map frame's axes.
import * as THREE from 'three';

const mostLines = 200;
const axisLength = 0.5;  // m

/** m from line to line */
function stepOf({ min, max }) {
  let step = 1;
  while ((max.x - min.x + max.y - min.y) / step > mostLines) step *= 10;
  return step;
}

export const grid = {
  id: 'grid', label: 'Grid', on: true,
  create(map, { extent, theme }) {
    const step = stepOf(extent), rotation = new THREE.Quaternion(...map.rotation), color = new THREE.Color(...theme.grid);
    const base = new THREE.Vector3(...map.origin).applyQuaternion(rotation);
    const middle = extent.getCenter(new THREE.Vector3()), size = extent.getSize(new THREE.Vector3());
    const count = 2 * Math.ceil(Math.max(size.x, size.y) / 2 / step + 1);
    for (const axis of ['x', 'y'])  // lines at whole metres of the map
      middle[axis] = Math.round((middle[axis] + base[axis]) / step) * step - base[axis];
    const lines = new THREE.GridHelper(count * step, count, color, color), object = new THREE.Group().add(lines);
    lines.rotation.x = Math.PI / 2;  // it is made for y upward
    lines.position.copy(middle.setZ(extent.min.z - 0.005));
    object.quaternion.copy(rotation.invert());
    return object;
  },
  legend: (map, { theme, extent }) => [{ line: theme.grid, text: `${stepOf(extent)} m` }],
};

export const axes = {
  id: 'axes', label: 'Map frame', on: false,
  create(map) {
    const object = new THREE.AxesHelper(axisLength);
    object.position.set(...map.origin).negate();
    return object;
  },
  legend: () => [{ line: [1, 0, 0], text: 'x' }, { line: [0, 1, 0], text: 'y' }, { line: [0, 0, 1], text: 'z, 0.5 m each' }],
};
