// The panel at the side: layers with their switches and choices, the legend, what was picked.
import { layers } from './layers/index.js';
import { css } from './shading.js';
import { heightOfOrigin, nameOfUp, upAxes } from './up.js';

/** @param {string} tag @param {object} properties @param {(Node|string)[]} children */
export function element(tag, properties = {}, ...children) {
  const result = Object.assign(document.createElement(tag), properties);
  result.append(...children);
  return result;
}

const byId = (id) => document.getElementById(id);
const thousands = (number) => number.toLocaleString('en').replaceAll(',', '\u202f');

function choiceOf(layer, stage, changed) {
  const choices = layer.choices?.(stage.map) ?? [], chosen = stage.settings.choice[layer.id];
  if (choices.length < 2) return [];
  const select = element('select', { ariaLabel: `${layer.label}: colours` },
    ...choices.map(({ id, label }) => element('option', { value: id, selected: id === chosen }, label)));
  select.onchange = () => {
    stage.choose(layer.id, select.value);
    changed();
  };
  return [select];
}

/**
 * @param {{label: string, least: number, greatest: number, step?: number, value: number,
 *          text: function(number): string}} range @param {function(number): void} moved
 */
function sliderOf(id, { label, least, greatest, step = 1, value, text }, moved) {
  const shown = element('span', { className: 'value' }, text(value));
  const slider = element('input', { type: 'range', min: least, max: greatest, step, value, id, ariaLabel: label });
  slider.oninput = () => {
    shown.textContent = text(Number(slider.value));
    moved(Number(slider.value));
  };
  return element('div', { className: 'range' }, slider, shown);
}

function rangeOf(layer, stage, changed) {
  const range = stage.settings.on[layer.id] ? layer.range?.(stage.map, stage.settings) : null;
  if (!range) return [];
  return [sliderOf(`range-${layer.id}`, { ...range, label: `${layer.label}: ${range.label}` }, (value) => {
    range.set(value);
    stage.renew(layer.id);
    changed();
  })];
}

/** A box with its label, and what else stands in its row. */
function rowOf(id, text, title, checked, onchange, ...more) {
  return element('div', { className: 'layer' }, element('input', { type: 'checkbox', id, checked, onchange }),
    element('label', { htmlFor: id, title }, ...text), ...more);
}

/** @param {function(): void} changed what is switched on @param {function(): void} moved a slider */
function layerRow(layer, number, stage, changed, moved) {
  const count = layer.count?.(stage.map, stage);
  const text = [layer.label, ...(count === undefined ? [] : [element('small', {}, ` ${thousands(count)}`)])];
  const title = number > 10 ? layer.label : `${layer.label} (${number % 10})`;
  return rowOf(`layer-${layer.id}`, text, title, stage.settings.on[layer.id], () => {
    stage.switch(layer.id);
    changed();
  }, ...choiceOf(layer, stage, changed), ...rangeOf(layer, stage, moved));
}

const filled = (className, background) => element('span', { className, style: `background: ${background}` });

function legendEntry({ color, line, ramp, text, low, high, ticks }) {
  if (ticks) {
    const marks = ticks.map(({ at, text: mark }) => element('span', { style: `left: ${100 * at}%` }, mark));
    return element('div', { className: 'scale' }, filled('ramp', ramp), element('div', { className: 'ticks' }, ...marks));
  }
  if (ramp) return element('div', { className: 'entry' }, low, filled('ramp', ramp), high);
  const mark = line ? filled('line', css(line)) : filled('swatch', color ? css(color) : 'none');
  return element('div', { className: 'entry' }, mark, element('span', {}, text));
}

function tableRows(rows, goTo) {
  return rows.map(({ name, text, ids }) => element('tr', {}, element('th', { scope: 'row' }, name), element('td', {},
    ...(ids?.map((one) => element('button', { className: 'id', onclick: () => goTo(one.id) }, one.text)) ?? [text]))));
}

export class Panel {
  /** @param {import('./stage.js').Stage} stage */
  constructor(stage) {
    this.stage = stage;
    this.folded = () => {};
    this.turned = () => {};  // with a direction that is to be up, or null: the map's own
    byId('fold').addEventListener('click', () => this.fold());
    if (window.innerWidth < 640) this.fold();
  }

  fold() {
    const body = byId('panel-body'), button = byId('fold');
    body.hidden = !body.hidden;
    button.textContent = body.hidden ? '+' : '–';
    button.setAttribute('aria-expanded', String(!body.hidden));
    this.folded();
  }

  /** Pixels that it takes from the left of the view; none where it lies across, or is folded. */
  get width() {
    return window.innerWidth < 640 || byId('panel-body').hidden ? 0 : byId('panel').getBoundingClientRect().right;
  }

  /** Everything that depends on the map or on what is switched on. */
  update() {
    const { stage } = this, { map } = stage;
    byId('title').textContent = map.name;
    document.title = `${map.name} · octosurf`;
    const area = map.surfaces.reduce((sum, one) => sum + one.area_m2, 0);
    byId('summary').textContent =
      `${thousands(map.surfaces.length)} surfaces, ${area.toFixed(1)} m² · d ${(100 * map.resolution).toFixed(1)} cm · revision ${map.revision}`;
    this.notice();
    const rows = layers.map((layer, i) => [layer, i + 1]).filter(([layer]) => stage.has(layer))
      .map(([layer, number]) => layerRow(layer, number, stage, () => this.update(), () => this.legend()));
    byId('layers').replaceChildren(...rows, this.backs(), this.up(), this.heights());
    this.legend();
  }

  legend() {
    const { stage } = this, { map } = stage;
    byId('legend').replaceChildren(...layers.filter((layer) => stage.shows(layer.id))
      .flatMap((layer) => layer.legend?.(map, stage) ?? []).map(legendEntry));
  }

  /** Walls and ceilings hide a room from outside. */
  backs() {
    const { stage } = this, { settings } = stage;
    return rowOf('backs', ['Seen from behind, too'], 'Surfaces seen from behind (b)', !settings.cut, () => {
      settings.cut = !settings.cut;
      stage.renew();
    });
  }

  /** Which way is up, and the other one that surfaces suggest. */
  up() {
    const { map, settings } = this.stage, own = nameOfUp(map.ownUp), present = settings.up ? nameOfUp(settings.up) : own;
    const names = [...new Set([own, ...Object.keys(upAxes), present])];
    const select = element('select', { id: 'up', title: 'Heights, slopes and the view are measured against it' },
      ...names.map((name) => element('option', { value: name === own ? 'own' : name, selected: name === present },
        name === own ? `${own}, the map’s` : name)));
    select.onchange = () => this.turned(upAxes[select.value] ?? null);
    const suggested = map.suggestedUp && nameOfUp(map.suggestedUp);
    const hint = suggested && suggested !== nameOfUp(map.up) ? [element('div', { className: 'hint' },
      `Surfaces suggest that up is ${suggested}.`,
      element('button', { id: 'up-suggested', onclick: () => this.turned(map.suggestedUp) }, 'Turn'))] : [];
    return element('div', { className: 'layer' }, element('label', { htmlFor: 'up' }, 'Up'), select, ...hint);
  }

  /** Limits of the heights that are shown; a slider at its end is none. */
  heights() {
    const { stage } = this, { map, settings } = stage, { min, max } = stage.extent, step = 0.05, room = 0.2;
    const zero = heightOfOrigin(map);
    const least = Math.floor((min.z + zero - room) / step) * step;
    const greatest = Math.ceil((max.z + zero + room) / step) * step;
    const row = (end, label, last) => {
      const isLast = (value) => Math.abs(value - last) < step / 2;
      const slider = sliderOf(`clip-${end}`, {
        label, least, greatest, step, value: settings.clip[end] ?? last,
        text: (value) => (isLast(value) ? 'nothing' : `${value.toFixed(2)} m`),
      }, (value) => stage.clipHeights({ ...settings.clip, [end]: isLast(value) ? null : value }));
      slider.prepend(element('label', { htmlFor: `clip-${end}` }, label));
      return slider;
    };
    return element('div', { className: 'layer', id: 'heights' }, row('to', 'Hide above', greatest),
      row('from', 'Hide below', least));
  }

  /** What the page's limit has left out. */
  notice() {
    const { map } = this.stage, notice = byId('notice'), voxels = `${thousands(map.voxelsBeforeMerging)} voxels`;
    const missing = [];
    if (map.merged === 0) missing.push(`Without voxels: ${voxels} do not fit into the page’s limit (view --max-mb).`);
    if (map.merged > 1) {
      missing.push(`Voxels are drawn merged to ${map.merged} d, ${(100 * map.merged * map.resolution).toFixed(0)} cm: ${
        voxels} do not fit into the page’s limit (view --max-mb).`);
    }
    if (map.feetLeftOut) missing.push('Nor do contact regions.');
    const [up, own] = [map.up, map.ownUp].map(nameOfUp);
    if (up !== own && map.feet.length > 0)
      missing.push(`Contact regions are for up = ${own}; --up ${up} makes them for this one.`);
    notice.hidden = missing.length === 0;
    notice.textContent = missing.join(' ');
  }

  /** What was picked and the panel would leave nothing of a narrow page. */
  makeRoom() {
    if (window.innerWidth < 640 && !byId('panel-body').hidden) this.fold();
  }

  /** Pixels of the page that nothing lies over. */
  free() {
    const { innerWidth: width, innerHeight: height } = window, narrow = width < 640;
    const box = (id) => byId(id).getBoundingClientRect();
    const covered = !byId('details').hidden;
    return {
      left: narrow ? 0 : this.width, top: narrow ? box('panel').bottom : 0,
      right: covered && !narrow ? box('details').left : width,
      bottom: covered && narrow ? box('details').top : height,
    };
  }

  /**
   * @param {{title: string, place: string?, rows: object[], lineage: object[]}?} what rows: describe.js; null: nothing
   * @param {function(string): void} goTo an id
   */
  details(what, goTo) {
    byId('details').hidden = what === null;
    if (what === null) return;
    byId('details-title').textContent = what.title;
    byId('place').hidden = what.place === null;
    byId('place-text').textContent = what.place;
    byId('place-copy').textContent = 'Copy';
    byId('details-table').replaceChildren(...tableRows(what.rows, goTo));
    byId('lineage').hidden = what.lineage.length === 0;
    byId('lineage-table').replaceChildren(...tableRows(what.lineage, goTo));
  }
}
