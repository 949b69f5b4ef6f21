// What the octree knows at one height: free, occupied, unknown.
import * as THREE from 'three';

const colors = { free: [70, 170, 220, 110], occupied: [25, 30, 40, 235], unknown: [0, 0, 0, 0] };
const order = [colors.unknown, colors.free, colors.occupied];  // OccupancyView::State

/** Heights of the map frame that there are slices at, by number. */
export function sliceHeight(map, number) {
  return map.slices.low[2] + number * map.slices.step;
}

/** The slice nearest to a height, or the one a metre over the lowest. */
export function sliceAt(map, height) {
  const { low, step, count } = map.slices;
  const wanted = height ?? low[2] + 1;
  return Math.min(count[2] - 1, Math.max(0, Math.round((wanted - low[2]) / step)));
}

function texture({ slices }, number) {
  const [nx, ny] = slices.count, pixels = new Uint8Array(4 * nx * ny);
  const states = slices.states.subarray(number * nx * ny, (number + 1) * nx * ny);
  states.forEach((state, i) => pixels.set(order[state], 4 * i));
  const result = new THREE.DataTexture(pixels, nx, ny);
  result.needsUpdate = true;
  return result;
}

export const slice = {
  id: 'slice', label: 'Free space', on: false,
  has: (map) => map.slices !== null,
  range: (map, settings) => ({
    least: 0, greatest: map.slices.count[2] - 1, value: sliceAt(map, settings.sliceHeight),
    text: (number) => `${sliceHeight(map, number).toFixed(2)} m`,
    set: (number) => { settings.sliceHeight = sliceHeight(map, number); },
  }),
  create(map, context) {
    const { slices } = map, number = sliceAt(map, context.settings.sliceHeight);
    const [nx, ny] = slices.count, { cell } = slices;
    const material = new THREE.MeshBasicMaterial({
      map: texture(map, number), transparent: true, side: THREE.DoubleSide, depthWrite: false,
    });
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(nx * cell, ny * cell), material);
    // Slices lie in the upright frame, layers in the map's.
    const rotation = new THREE.Quaternion(...map.rotation);
    const middle = new THREE.Vector3(slices.low[0] + (nx - 1) / 2 * cell, slices.low[1] + (ny - 1) / 2 * cell,
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
