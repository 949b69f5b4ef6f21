// The page: reads its map, puts the parts together.
import { readTextBlock } from './block.js';
import { newMap, takeSurfaces, takeVoxels } from './data.js';
import { describe, lineOf } from './describe.js';
import { Following, runToFollow } from './follow.js';
import { Highlight } from './highlight.js';
import { Measure } from './measure.js';
import { Panel } from './panel.js';
import { pick } from './picking.js';
import { bindPointer } from './pointer.js';
import { Stage } from './stage.js';
import { View } from './view.js';

const byId = (id) => document.getElementById(id);
const obliquely = [-0.55, -0.75, 0.75];  // as pictures are drawn

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
    this.map = map;
    this.view = new View(byId('view'), () => this.panel?.taken ?? [0, 0]);
    this.stage = new Stage(this.view, map);
    this.highlight = new Highlight(this.view);
    this.measure = new Measure(this.view, this.highlight);
    this.panel = new Panel(this.stage, () => this.view.resize(), (up) => this.turn(up));
    this.panel.update();
    this.view.resize();
    this.fit();
    this.wasEmpty = map.surfaces.length === 0;
    this.bind();
  }

  /** The map's surfaces and cylinders have changed. What was picked stays picked while it is there. */
  renewSurfaces() {
    const { kind, what } = this.picked ?? {}, { map, wasEmpty } = this;
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
    this.stage.renew('voxels');
    this.panel.update();
  }

  say(text) { say(text); }

  /** @param {number[]?} up null: the map's own */
  turn(up) {
    this.clear();
    this.stage.turn(up);
    this.panel.update();
    this.fit();
  }

  fit(from = obliquely) { this.view.fit(from); }

  clear() {
    this.select(null);
    this.measure.clear();
    this.hover(null);
  }

  hit(x, y) { return pick(this.stage, this.view.ray(x, y)); }

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
    this.panel.details(hit && describe(this.map, hit));
  }

  click(x, y) {
    const hit = this.hit(x, y);
    if (!this.measure.on) this.select(hit);
    else if (hit) this.measure.add(hit.place, this.map.up);
  }

  bind() {
    bindPointer(this.view, { hover: (x, y) => this.hover(this.hit(x, y), x, y), leave: () => this.hover(null),
      click: (x, y) => this.click(x, y) });
    const press = (id, act) => byId(id).addEventListener('click', act);
    press('fit', () => this.fit());
    press('top', () => this.fit([0, -1e-3, 1]));
    press('details-close', () => this.select(null));
    document.addEventListener('keydown', ({ key }) => { if (key === 'Escape') this.clear(); });
  }
}

async function start() {
  if (!window.DecompressionStream) return say('This browser is too old for the page: it needs DecompressionStream.');
  const page = new Page(await readMap());
  window.octosurf = page;  // for the console, and for tests
  if (runToFollow()) page.following = new Following(page, runToFollow());
  return page;
}

start().catch((error) => {
  say(`The page cannot be shown: ${error.message}`);
  throw error;
});
