// The page: reads its map, puts the parts together.
import * as THREE from 'three';
import { readTextBlock } from './block.js';
import { middleOf, newMap, takeSurfaces, takeVoxels } from './data.js';
import { describe, find, lineOf } from './describe.js';
import { Following } from './follow.js';
import { Highlight } from './highlight.js';
import { bindKeys } from './keys.js';
import { Measure } from './measure.js';
import { Panel } from './panel.js';
import { pick } from './picking.js';
import { bindPointer } from './pointer.js';
import { Asking, hasServer, runToFollow } from './server.js';
import { Stage } from './stage.js';
import { Theme } from './theme.js';
import { View } from './view.js';

const byId = (id) => document.getElementById(id);

/** Over all else; empty: nothing more. */
function say(text) {
  byId('message').hidden = text === '';
  byId('message').textContent = text;
}

/** The page has a message of the map's surfaces, then one of its voxels. */
async function readMap() {
  const map = newMap();
  for (const script of document.querySelectorAll('script.map')) {
    const message = await readTextBlock(script.textContent);
    script.remove();  // its text is no longer needed, and takes memory
    if (message.json.kind === 'voxels') takeVoxels(map, message);
    else takeSurfaces(map, message);
  }
  return map;
}

class Page {
  constructor(map) {
    this.view = new View(byId('view'));
    this.theme = new Theme(() => this.recolor());
    this.stage = new Stage(this.view, this.theme);
    this.highlight = new Highlight(this.view);
    this.measure = new Measure(this.view, this.highlight);
    this.panel = new Panel(this.stage);
    this.recolor();
    this.panel.folded = () => this.view.setInset(this.panel.width);
    this.panel.folded();
    this.panel.turned = (up) => this.turn(up);
    this.stage.show(map);
    this.panel.update();
    this.fit();
    this.wasEmpty = this.map.surfaces.length === 0;
    this.bind();
  }

  get map() { return this.stage.map; }

  recolor() {
    this.view.renderer.setClearColor(this.theme.paper);
    this.stage.renew();
    if (this.map) this.panel.update();
  }

  /** The map's surfaces and cylinders have changed. What was picked stays picked while it is there. */
  renewSurfaces() {
    const { kind, what } = this.picked ?? {}, { map } = this, wasEmpty = this.wasEmpty;
    this.wasEmpty = map.surfaces.length === 0;
    this.stage.mapChanged();
    if (kind === 'surface' || kind === 'cylinder') {
      const again = kind === 'surface' ? map.surface(what.id) : map.cylinder(what.id);
      if (again !== what) this.select(again ? { ...this.picked, what: again } : null);
    }
    this.hover(null);
    this.panel.update();
    if (wasEmpty) this.fit();
  }

  /** The map's voxels have. */
  renewVoxels() {
    if (this.picked?.kind === 'voxel') this.select(null);
    this.hover(null);
    this.stage.voxelsChanged();
    this.panel.update();
  }

  say(text) { say(text); }

  /** Contact regions that were asked for, in the place of those asked for before. */
  takeFoot(foot) {
    this.map.feet = [foot, ...this.map.feet.filter(({ name }) => !name.startsWith('asked '))];
    this.stage.settings.choice.regions = foot.name;
    this.showAnew('regions');
  }

  showAnew(layer) {
    this.stage.settings.on[layer] = true;
    this.stage.renew(layer);
    this.panel.update();
    if (this.picked) this.select(this.picked);
  }

  /** @param {number[]?} up null: the map's own */
  turn(up) {
    this.clear();
    this.stage.turn(up);
    this.panel.update();
    this.fit();
  }

  fit(from = this.stage.side) { this.view.fit(this.stage.extent, from); }

  clear() {
    this.select(null);
    this.measure.clear();
    this.hover(null);
  }

  hit(x, y) {
    return this.map ? pick(this.stage, this.view.ray(x, y)) : null;
  }

  /** @param {import('./picking.js').Hit?} hit */
  hover(hit, x = 0, y = 0) {
    const tip = byId('tip'), same = hit?.what === this.hovered?.what && hit?.kind === this.hovered?.kind;
    tip.hidden = hit === null;
    if (hit) {
      tip.textContent = lineOf(this.map, hit);
      const left = Math.min(x + 14, window.innerWidth - tip.offsetWidth - 8);
      tip.style.transform = `translate(${left}px, ${Math.max(4, y - 34)}px)`;
    }
    if (!same) this.highlight.hover(this.map, hit);
    this.hovered = hit;
  }

  /** @param {import('./picking.js').Hit?} hit */
  select(hit) {
    this.picked = hit;
    this.highlight.picked(this.map, hit);
    this.panel.details(hit && describe(this.map, hit, this.stage.settings), (id) => this.search(id));
  }

  /** Selects it, and moves it out from under what the page says about it. */
  show(hit) {
    this.select(hit);
    if (!hit) return;
    this.panel.makeRoom();
    this.view.reveal(hit.place, this.panel.free());
  }

  click(x, y) {
    const hit = this.hit(x, y);
    if (!this.measure.on) this.show(hit);
    else if (hit) this.measure.add(hit.place, this.map.up);
  }

  /** Selects what has that id and looks at it; says what became of it if it is gone. @param {number[]?} place on it */
  search(text, place) {
    const { hit, answer, successor } = find(this.map, text);
    byId('search-answer').textContent = answer;
    const found = hit ?? (successor ? find(this.map, successor).hit : undefined);
    if (!found) return false;
    this.lookAt(found);
    this.show({ ...found, place: place ?? (found.kind === 'surface' ? middleOf(found.what) : found.what.axis_point) });
    return true;
  }

  /** Moves the camera so far that the thing is in the middle, from the side it is seen from. */
  lookAt({ kind, what }) {
    const root = this.view.root, place = kind === 'surface' ? middleOf(what) : what.axis_point;
    const target = root.localToWorld(new THREE.Vector3(...place));
    const offset = this.view.camera.position.clone().sub(this.view.controls.target);
    if (kind === 'surface') {
      const normal = new THREE.Vector3(...what.normal).applyQuaternion(root.quaternion);
      const height = offset.dot(normal);
      if (height < 0.3 * offset.length()) offset.addScaledVector(normal, 0.5 * offset.length() - height);
    }
    const size = kind === 'surface' ? Math.sqrt(what.area_m2) : what.length_m;
    offset.setLength(Math.min(offset.length(), Math.max(1.5, 3 * size)));
    this.view.look(offset.add(target).toArray(), target.toArray());
  }

  /** Says on the button whether the clipboard has the text; browsers give none to other machines' pages without TLS. */
  async copy(text, button) {
    const name = button.dataset.name ??= button.textContent, copied = navigator.clipboard?.writeText(text);
    button.textContent = await copied?.then(() => true, () => false) ? 'Copied' : 'Not copied';
    setTimeout(() => { button.textContent = name; }, 1500);
  }

  bind() {
    bindKeys(this);
    bindPointer(this.view, { hover: (x, y) => this.hover(this.hit(x, y), x, y), leave: () => this.hover(null),
      click: (x, y) => this.click(x, y) });
    const press = (id, act) => byId(id).addEventListener('click', act);
    press('fit', () => this.fit());
    press('top', () => this.fit([0, -1e-3, 1]));
    press('help', () => {
      byId('keys').hidden = !byId('keys').hidden;
      byId('help').setAttribute('aria-expanded', String(!byId('keys').hidden));
    });
    press('place-copy', () => this.copy(byId('place-text').textContent, byId('place-copy')));
    press('details-close', () => this.select(null));
    byId('search').addEventListener('submit', (event) => {
      event.preventDefault();
      this.search(byId('search-text').value);
    });
  }
}

async function start() {
  if (!window.DecompressionStream) return say('This browser is too old for the page: it needs DecompressionStream.');
  const page = new Page(await readMap());
  window.octosurf = page;  // for the console, and for tests
  if (hasServer()) page.asking = new Asking(page);
  if (runToFollow()) page.following = new Following(page, runToFollow());
  return page;
}

start().catch((error) => {
  say(`The page cannot be shown: ${error.message}`);
  throw error;
});
