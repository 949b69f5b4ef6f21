// Footstep plans: soles where they stand, numbered in their order, and the way of the body.
import * as THREE from 'three';
import { Lines } from './lines.js';
import { Triangles } from './mesh.js';

const startColor = [0.4, 0.4, 0.44], wayColor = [0.85, 0.2, 0.75];
const footColors = {
  left: [0.85, 0.12, 0.12], right: [0.08, 0.6, 0.2], front_left: [0.85, 0.12, 0.12], front_right: [0.08, 0.6, 0.2],
  hind_left: [0.95, 0.55, 0.5], hind_right: [0.5, 0.8, 0.55],
};
const raised = 0.006;      // m over the surface, each step a little more, so that a later one covers an earlier
const raisedMore = 0.0002;
const labelSize = 0.09;    // m

const shown = (map, { settings }) => {
  const chosen = settings.choice.plans;
  const found = map.plans.filter(({ name }) => name === chosen);
  return found.length > 0 ? found : map.plans;
};

/** Each outline as a fan of triangles: soles are convex. */
function addSole(triangles, lines, map, { outline }, color, number) {
  const height = raised + number * raisedMore;
  const lifted = outline.map((corner) => corner.map((x, k) => x + height * map.up[k]));
  triangles.add(map, lifted, map.up, color, lifted.slice(2).flatMap((_, i) => [0, i + 1, i + 2]));
  lifted.forEach((corner, i) => lines.add(corner, lifted[(i + 1) % lifted.length], color.map((value) => 0.5 * value)));
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

function objectOf(plan, map) {
  const group = new THREE.Group(), triangles = new Triangles(), lines = new Lines();
  for (const step of plan.start) addSole(triangles, lines, map, step, startColor, 0);
  plan.steps.forEach((step, i) => addSole(triangles, lines, map, step, footColors[step.foot], i + 1));
  plan.body.slice(1).forEach(({ at }, i) => lines.add(plan.body[i].at, at, wayColor));
  group.add(triangles.mesh(), lines.object(1.6));
  plan.steps.forEach(({ at }, i) =>
    group.add(numberAt(String(i + 1), at.map((x, k) => x + 0.5 * labelSize * map.up[k]))));
  return group;
}

const told = ({ name, found, steps, refusal }) =>
  `${name}: ${found ? `${steps.length} steps` : `no plan: ${refusal?.sentence ?? 'it does not say why'}`}`;

export const plans = {
  id: 'plans', label: 'Plans', on: true,
  has: (map) => map.plans.length > 0,
  count: (map) => map.plans.length,
  choices: (map) => [{ id: 'all', label: 'all' }, ...map.plans.map(({ name }) => ({ id: name, label: name }))],
  create(map, stage) {
    const group = new THREE.Group();
    for (const plan of shown(map, stage)) group.add(objectOf(plan, map));
    return group;
  },
  legend: (map, stage) => [...shown(map, stage).map((plan) => ({ text: told(plan) })),
    { color: startColor, text: 'where the feet stand at first' },
    { color: footColors.left, text: 'a left foot’s step' }, { color: footColors.right, text: 'a right foot’s step' },
    { line: wayColor, text: 'way of the body' }],
};
