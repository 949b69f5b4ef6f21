// Where the sensor is whose scans make the map, and where it has been.
import * as THREE from 'three';
import { Lines, ribbons } from './ribbons.js';

const trackColor = [0.85, 0.2, 0.75], sensorColor = [0.95, 0.35, 0.1];
const size = 0.3;                    // m
const [halfWide, halfHigh] = [0.55, 0.42];  // of a depth camera's picture at distance 1

/** A camera's view, as far as `size`: z points forward, y down. */
function camera(at, lines) {
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => at(a * halfWide * size, b * halfHigh * size, size));
  corners.forEach((corner, i) => {
    lines.add(at(0, 0, 0), corner, sensorColor);
    lines.add(corner, corners[(i + 1) % 4], sensorColor);
  });
  const [left, right] = [-0.3, 0.3].map((a) => at(a * halfWide * size, -halfHigh * size, size));
  const tip = at(0, -1.35 * halfHigh * size, size);
  lines.add(left, tip, sensorColor);
  lines.add(tip, right, sensorColor);
}

/** A lidar: a ring, its axis and an arrow along x. */
function lidar(at, lines) {
  const count = 24, round = (i) => [Math.cos(2 * Math.PI * i / count), Math.sin(2 * Math.PI * i / count)];
  for (let i = 0; i < count; ++i) {
    const [from, to] = [round(i), round(i + 1)].map(([a, b]) => at(0.5 * size * a, 0.5 * size * b, 0));
    lines.add(from, to, sensorColor);
  }
  lines.add(at(0, 0, 0), at(0, 0, 0.5 * size), sensorColor);
  lines.add(at(0, 0, 0), at(size, 0, 0), sensorColor);
}

export const sensor = {
  id: 'sensor', label: 'Sensor', on: true,
  has: (map) => map.sensor !== null,
  create(map, context) {
    const { kind, origin, axes, track } = map.sensor, lines = new Lines(), group = new THREE.Group();
    const at = (...xyz) => [0, 1, 2].map((k) => origin[k] + xyz.reduce((sum, x, i) => sum + x * axes[i][k], 0));
    [...track, origin].slice(1).forEach((place, i) => lines.add(track[i], place, trackColor));
    (kind === 'lidar' ? lidar : camera)(at, lines);
    group.add(ribbons(lines, context, 2.2));
    return group;
  },
  legend: () => [{ line: sensorColor, text: 'the sensor, at its last scan' }, { line: trackColor, text: 'its way' }],
};
