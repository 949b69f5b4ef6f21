// What the octree knows at one height: free, occupied, unknown.
import * as THREE from 'three';

const colors = { free: [70, 170, 220, 110], occupied: [25, 30, 40, 235], unknown: [0, 0, 0, 0] };
const order = [colors.unknown, colors.free, colors.occupied];  // OccupancyView::State

/**
 * The stack of slices as they lie with the map's present up: the one that was stored, or turned; looked up in it then.
 * @returns {{low: number[], cell: number, step: number, count: number[], back: THREE.Matrix4}} back: from its cells to
 *          those stored
 */
function gridOf(map) {
  const { slices } = map;
  if (slices.grid?.rotation === map.rotation) return slices.grid;
  const spacing = (x) => [slices.cell, slices.cell, slices.step].map((one, k) => one * x[k]);
  const turn = new THREE.Quaternion(...map.rotation).multiply(new THREE.Quaternion(...slices.rotation).invert());
  const box = new THREE.Box3(), far = spacing(slices.count.map((n) => n - 1));
  for (let corner = 0; corner < 8; ++corner) {
    const place = slices.low.map((x, k) => x + (corner >> k & 1) * far[k]);
    box.expandByPoint(new THREE.Vector3(...place).applyQuaternion(turn));
  }
  const size = spacing([1, 1, 1]), low = box.min.toArray();
  const count = box.getSize(new THREE.Vector3()).toArray().map((length, k) => Math.floor(length / size[k] + 1e-6) + 1);
  const back = new THREE.Matrix4().makeScale(...size.map((x) => 1 / x))
    .multiply(new THREE.Matrix4().makeTranslation(...slices.low.map((x) => -x)))
    .multiply(new THREE.Matrix4().makeRotationFromQuaternion(turn.invert()))
    .multiply(new THREE.Matrix4().makeTranslation(...low))
    .multiply(new THREE.Matrix4().makeScale(...size));
  slices.grid = { low, cell: slices.cell, step: slices.step, count, back, rotation: map.rotation };
  return slices.grid;
}

/** Heights of the map frame that there are slices at, by number. */
function sliceHeight(map, number) {
  const { low, step } = gridOf(map);
  return low[2] + number * step;
}

/** The slice nearest to a height, or the one a metre over the lowest. */
function sliceAt(map, height) {
  const { low, step, count } = gridOf(map);
  const wanted = height ?? low[2] + 1;
  return Math.min(count[2] - 1, Math.max(0, Math.round((wanted - low[2]) / step)));
}

function texture({ slices }, { count: [nx, ny], back }, number) {
  const pixels = new Uint8Array(4 * nx * ny), cell = new THREE.Vector3(), [mx, my, mz] = slices.count;
  for (let j = 0; j < ny; ++j) {
    for (let i = 0; i < nx; ++i) {
      const [x, y, z] = cell.set(i, j, number).applyMatrix4(back).toArray().map(Math.round);
      const known = x >= 0 && y >= 0 && z >= 0 && x < mx && y < my && z < mz;
      if (known) pixels.set(order[slices.states[(z * my + y) * mx + x]], 4 * (j * nx + i));
    }
  }
  const result = new THREE.DataTexture(pixels, nx, ny);
  result.needsUpdate = true;
  return result;
}

export const slice = {
  id: 'slice', label: 'Free space', on: false,
  has: (map) => map.slices !== null,
  range: (map, settings) => ({
    label: 'height', least: 0, greatest: gridOf(map).count[2] - 1, value: sliceAt(map, settings.sliceHeight),
    text: (number) => `${sliceHeight(map, number).toFixed(2)} m`,
    set: (number) => { settings.sliceHeight = sliceHeight(map, number); },
  }),
  create(map, context) {
    const grid = gridOf(map), number = sliceAt(map, context.settings.sliceHeight);
    const { cell, low, count: [nx, ny] } = grid;
    const material = new THREE.MeshBasicMaterial({
      map: texture(map, grid, number), transparent: true, side: THREE.DoubleSide, depthWrite: false,
    });
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(nx * cell, ny * cell), material);
    // Slices lie in the upright frame, layers in the map's.
    const rotation = new THREE.Quaternion(...map.rotation);
    const middle = new THREE.Vector3(low[0] + (nx - 1) / 2 * cell, low[1] + (ny - 1) / 2 * cell,
      sliceHeight(map, number)).applyQuaternion(rotation.clone().invert());
    plane.position.copy(middle.sub(new THREE.Vector3(...map.origin)));
    plane.quaternion.copy(rotation.invert());
    return plane;
  },
  legend: (map) => [
    { color: [0.27, 0.67, 0.86], text: 'free at that height' }, { color: [0.1, 0.12, 0.16], text: 'occupied' },
    { text: `unknown: not drawn; looked up every ${(100 * map.slices.cell).toFixed(0)} cm` },
  ],
};
