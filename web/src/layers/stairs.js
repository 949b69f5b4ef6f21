// Stairs: the front edges of their treads, and the way up over the middles. The legend has their numbers.
import { Lines } from './lines.js';

const color = [0.9, 0.1, 0.45];
const raised = 0.01;  // m over the treads

const cm = (meters) => (100 * meters).toFixed(1);

/** "6 risers of 17.0 cm, treads of 29.0 cm, 1.20 m wide" */
export function textOf({ kind, risers, riser_m: riser, tread_m: tread, width_m: width }) {
  const course = kind === 'straight' ? '' : `${kind}, `;
  return `${course}${risers} risers of ${cm(riser)} cm, treads of ${cm(tread)} cm, ${width.toFixed(2)} m wide`;
}

export const stairs = {
  id: 'stairs', label: 'Stairs', on: true,
  has: (map) => map.stairs.length > 0,
  count: (map) => map.stairs.length,
  create(map) {
    const lines = new Lines();
    for (const { steps } of map.stairs) {
      const ends = steps.map(({ edge }) => edge.map((end) => end.map((x, k) => x + raised * map.up[k])));
      const middles = ends.map(([left, right]) => left.map((x, k) => (x + right[k]) / 2));
      for (const [left, right] of ends) lines.add(left, right, color);
      for (let i = 1; i < middles.length; ++i) lines.add(middles[i - 1], middles[i], color);
    }
    return lines.object(2.5);
  },
  legend: (map) => map.stairs.map((one) => ({ line: color, text: `stair ${one.id}: ${textOf(one)}` })),
};
