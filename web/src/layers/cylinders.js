// Cylinders: the part of the mantle that was seen.
import { mesh } from './mesh.js';

const color = [0.85, 0.55, 0.2];
const stepRad = Math.PI / 24;

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

export function mantleOf(cylinders) {
  const positions = [], normals = [], colors = [], indices = [];
  for (const { axis_point: middle, axis, radius_m: radius, length_m: length, start, span_rad: span } of cylinders) {
    const other = cross(axis, start);
    const steps = Math.max(1, Math.ceil(span / stepRad));
    const first = positions.length / 3;
    for (let i = 0; i <= steps; ++i) {
      const angle = span * i / steps;
      const out = [0, 1, 2].map((k) => Math.cos(angle) * start[k] + Math.sin(angle) * other[k]);
      for (const end of [-0.5, 0.5]) {
        positions.push(...[0, 1, 2].map((k) => middle[k] + radius * out[k] + end * length * axis[k]));
        normals.push(...out);
        colors.push(...color.map((value) => Math.round(255 * value)));
      }
      const k = first + 2 * i;
      if (i < steps) indices.push(k, k + 2, k + 1, k + 1, k + 2, k + 3);
    }
  }
  return {
    positions: new Float32Array(positions), normals: new Float32Array(normals),
    colors: new Uint8Array(colors), indices: new Uint32Array(indices),
  };
}

export const cylinders = {
  id: 'cylinders', label: 'Cylinders', on: true,
  has: (map) => map.cylinders.length > 0,
  count: (map) => map.cylinders.length,
  create: (map, context) => mesh(mantleOf(map.cylinders), { ...context, cut: { value: false } }),
  legend: () => [{ color, text: 'cylinder, as far as it was seen' }],
};
