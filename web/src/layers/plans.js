// Footstep plans: soles where they stand, numbered in their order, and the way of the body.
import * as THREE from 'three';
import { mesh } from './mesh.js';
import { Lines, ribbons } from './ribbons.js';

const startColor = [0.4, 0.4, 0.44], wayColor = [0.85, 0.2, 0.75];
const footColors = {
  left: [0.85, 0.12, 0.12], right: [0.08, 0.6, 0.2], front_left: [0.85, 0.12, 0.12], front_right: [0.08, 0.6, 0.2],
  hind_left: [0.95, 0.55, 0.5], hind_right: [0.5, 0.8, 0.55],
};
const raised = 0.006;      // m over the surface, each step a little more, so that a later one covers an earlier
const raisedMore = 0.0002;
const labelSize = 0.09;    // m

const shown = (map, context) => {
  const chosen = context.settings.choice.plans;
  const found = map.plans.filter(({ name }) => name === chosen);
  return found.length > 0 ? found : map.plans;
};

/** Each outline as a fan of triangles: soles are convex. */
function solesOf(plan, up) {
  const positions = [], normals = [], colors = [], indices = [], lines = new Lines();
  const add = (step, color, number) => {
    const first = positions.length / 3, height = raised + number * raisedMore;
    const lifted = step.outline.map((corner) => corner.map((x, k) => x + height * up[k]));
    lifted.forEach((corner, i) => {
      positions.push(...corner);
      normals.push(...up);
      colors.push(...color.map((value) => Math.round(255 * value)));
      if (i >= 2) indices.push(first, first + i - 1, first + i);
      lines.add(corner, lifted[(i + 1) % lifted.length], color.map((value) => 0.5 * value));
    });
  };
  plan.start.forEach((step) => add(step, startColor, 0));
  plan.steps.forEach((step, i) => add(step, footColors[step.foot], i + 1));
  return { lines, parts: {
    positions: new Float32Array(positions), normals: new Float32Array(normals), colors: new Uint8Array(colors),
    indices: new Uint32Array(indices),
  } };
}

function numberAt(text, place) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext('2d');
  pen.font = 'bold 40px sans-serif';
  pen.textAlign = 'center';
  pen.textBaseline = 'middle';
  pen.lineWidth = 8;
  pen.strokeStyle = '#000b';
  pen.fillStyle = '#fff';
  pen.strokeText(text, 32, 34);
  pen.fillText(text, 32, 34);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas), depthWrite: false }));
  sprite.scale.setScalar(labelSize);
  sprite.position.set(...place);
  return sprite;
}

function objectOf(plan, map, context) {
  const group = new THREE.Group(), cut = { value: false }, { lines, parts } = solesOf(plan, map.up);
  plan.body.slice(1).forEach(({ at }, i) => lines.add(plan.body[i].at, at, wayColor));
  group.add(mesh(parts, { ...context, cut }), ribbons(lines, context, 1.6, cut));
  plan.steps.forEach(({ at }, i) =>
    group.add(numberAt(String(i + 1), at.map((x, k) => x + 0.5 * labelSize * map.up[k]))));
  return group;
}

const told = ({ name, found, steps, sentence }) =>
  `${name}: ${found ? `${steps.length} steps` : `no plan: ${sentence ?? 'it does not say why'}`}`;

export const plans = {
  id: 'plans', label: 'Plans', on: true,
  has: (map) => map.plans.length > 0,
  count: (map) => map.plans.length,
  choices: (map) => [{ id: 'all', label: 'all' }, ...map.plans.map(({ name }) => ({ id: name, label: name }))],
  create(map, context) {
    const group = new THREE.Group();
    for (const plan of shown(map, context)) group.add(objectOf(plan, map, context));
    return group;
  },
  legend: (map, context) => [...shown(map, context).map((plan) => ({ text: told(plan) })),
    { color: startColor, text: 'where the feet stand at first' },
    { color: footColors.left, text: 'a left foot’s step' }, { color: footColors.right, text: 'a right foot’s step' },
    { line: wayColor, text: 'way of the body' }],
};
