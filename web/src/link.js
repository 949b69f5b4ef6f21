// What the page shows as its address's fragment, and back: camera, up, layers, heights, what is picked.
//
// Places are in the map frame, so that a link outlives a change of the data's origin.
import { layers } from './layers/index.js';

const written = (values) => values.map((x) => Number(x.toFixed(4))).join(',');

/** @returns {number[]?} so many finite numbers */
function numbersOf(text, count) {
  const numbers = (text ?? '').split(',').map((one) => (one.trim() === '' ? NaN : Number(one)));
  return numbers.length === count && numbers.every(Number.isFinite) ? numbers : null;
}

/** @param {object} page see main.js @returns {string} to stand behind the # */
export function linkOf(page) {
  const { map, view, stage, timeline } = page, { settings } = stage, link = new URLSearchParams();
  const inMap = (place) => written(map.toMap(view.root.worldToLocal(place.clone()).toArray()));
  if (timeline.at !== timeline.maps.length - 1) link.set('map', timeline.at + 1);
  if (settings.up) link.set('up', written(settings.up));
  link.set('eye', inMap(view.camera.position));
  link.set('target', inMap(view.controls.target));
  link.set('layers', layers.filter(({ id }) => settings.on[id]).map(({ id }) => id).join('.'));
  for (const [id, choice] of Object.entries(settings.choice)) link.set(`color.${id}`, choice);
  if (!settings.cut) link.set('behind', 'shown');
  if (settings.clip.from !== null) link.set('from', written([settings.clip.from]));
  if (settings.clip.to !== null) link.set('to', written([settings.clip.to]));
  if (page.picked && page.picked.kind !== 'voxel') {
    link.set('picked', `${page.picked.kind === 'cylinder' ? 'c' : ''}${page.picked.what.id}`);
    if (page.picked.place) link.set('at', written(map.toMap(page.picked.place)));
  }
  return link.toString();
}

/** @param {object} page see main.js @param {string} text behind the #; what of it makes no sense is left out */
export function follow(page, text) {
  const link = new URLSearchParams(text), { view, stage, timeline } = page, { settings } = stage;
  const number = numbersOf(link.get('map'), 1);
  if (number) timeline.show(Math.round(number[0]) - 1);
  const { map } = page, inRoot = (place) => place.map((x, k) => x - map.origin[k]);
  const up = numbersOf(link.get('up'), 3);
  const wanted = up && Math.hypot(...up) > 0 ? up : null;
  if (wanted || settings.up) page.turn(wanted);
  if (link.has('layers')) {
    const on = new Set(link.get('layers').split('.'));
    for (const { id } of layers) settings.on[id] = on.has(id);
  }
  for (const { id } of layers) if (link.has(`color.${id}`)) settings.choice[id] = link.get(`color.${id}`);
  settings.cut = link.get('behind') !== 'shown';
  stage.clipHeights({ from: numbersOf(link.get('from'), 1)?.[0] ?? null, to: numbersOf(link.get('to'), 1)?.[0] ?? null });
  stage.renew();
  const [eye, target, at] = ['eye', 'target', 'at'].map((name) => numbersOf(link.get(name), 3));
  page.clear();
  if (link.has('picked')) page.search(link.get('picked'), at ? inRoot(at) : undefined);
  if (eye && target) {
    page.fit();  // for the camera's near and far
    view.look(...[eye, target].map((place) => stage.upright(inRoot(place))));
  }
  page.panel.update();
}
