// Where the sensor is whose scans make the map, as its axes, and where it has been.
import * as THREE from 'three';
import { Lines } from './lines.js';

const trackColor = [0.85, 0.2, 0.75];
const size = 0.3;  // m

export const sensor = {
  id: 'sensor', label: 'Sensor', on: true,
  has: (map) => map.sensor !== null,
  create(map) {
    const { origin, axes, track } = map.sensor, lines = new Lines(), pose = new THREE.AxesHelper(size);
    [...track, origin].slice(1).forEach((place, i) => lines.add(track[i], place, trackColor));
    pose.position.set(...origin);
    pose.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(...axes.map((axis) => new THREE.Vector3(...axis))));
    return new THREE.Group().add(lines.object(2.2), pose);
  },
  legend: () => [{ line: [0, 0, 1], text: 'the sensor, at its last scan: x red, y green, z blue' },
    { line: trackColor, text: 'its way' }],
};
