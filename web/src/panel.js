// The panel at the side: layers with their switches and choices, the legend, what was picked.
import { layers } from './layers/index.js';
import { css } from './shading.js';
import { nameOfUp, upAxes } from './up.js';

/** @param {string} tag @param {object} properties @param {(Node|string)[]} children */
function element(tag, properties = {}, ...children) {
  const result = Object.assign(document.createElement(tag), properties);
  result.append(...children);
  return result;
}

const byId = (id) => document.getElementById(id);
const thousands = (number) => number.toLocaleString('en').replaceAll(',', '\u202f');

function choiceOf(layer, stage, changed) {
  const choices = layer.choices?.(stage.map) ?? [], chosen = stage.settings.choice[layer.id];
  if (choices.length < 2) return [];
  const select = element('select', { ariaLabel: `${layer.label}: which` },
    ...choices.map(({ id, label }) => element('option', { value: id, selected: id === chosen }, label)));
  select.onchange = () => {
    stage.choose(layer.id, select.value);
    changed();
  };
  return [select];
}

/** @param {function(): void} changed what is switched on */
function layerRow(layer, stage, changed) {
  const { map, settings } = stage, count = layer.count?.(map, settings), id = `layer-${layer.id}`;
  const box = element('input', { type: 'checkbox', id, checked: settings.on[layer.id] });
  box.onchange = () => {
    stage.switch(layer.id);
    changed();
  };
  const text = [layer.label, ...(count === undefined ? [] : [element('small', {}, ` ${thousands(count)}`)])];
  return element('div', { className: 'layer' }, box, element('label', { htmlFor: id }, ...text),
    ...choiceOf(layer, stage, changed));
}

function legendEntry({ color, line, ramp, text, low, high }) {
  const filled = (className, background) => element('span', { className, style: `background: ${background}` });
  const parts = ramp ? [low, filled('ramp', ramp), high]
    : [line ? filled('line', css(line)) : filled('swatch', css(color)), element('span', {}, text)];
  return element('div', { className: 'entry' }, ...parts);
}

export class Panel {
  /**
   * @param {import('./stage.js').Stage} stage @param {function(): void} folded
   * @param {function(number[]?): void} turned with a direction that is to be up, or null: the map's own
   */
  constructor(stage, folded, turned) {
    Object.assign(this, { stage, turned });
    byId('fold').addEventListener('click', () => {
      this.fold();
      folded();
    });
    if (window.innerWidth <= 640) this.fold();
  }

  fold() {
    const body = byId('panel-body'), button = byId('fold');
    body.hidden = !body.hidden;
    button.textContent = body.hidden ? '+' : '–';
    button.setAttribute('aria-expanded', String(!body.hidden));
  }

  /** Pixels that it takes from the left of the view, or from above where it lies across. */
  get taken() {
    const { right, bottom } = byId('panel').getBoundingClientRect();
    return window.innerWidth <= 640 ? [0, bottom] : [byId('panel-body').hidden ? 0 : right, 0];
  }

  /** Everything that depends on the map or on what is switched on. */
  update() {
    const { stage } = this, { map } = stage, area = map.surfaces.reduce((sum, one) => sum + one.area_m2, 0);
    byId('title').textContent = map.name;
    document.title = `${map.name} · octosurf`;
    byId('summary').textContent = `${thousands(map.surfaces.length)} surfaces, ${area.toFixed(1)} m² · d ${
      (100 * map.resolution).toFixed(1)} cm · revision ${map.revision}`;
    this.notice();
    const rows = layers.filter((layer) => stage.has(layer)).map((layer) => layerRow(layer, stage, () => this.update()));
    byId('layers').replaceChildren(...rows, this.up());
    byId('legend').replaceChildren(...layers.filter((layer) => stage.shows(layer.id))
      .flatMap((layer) => layer.legend(map, stage.settings)).map(legendEntry));
  }

  /** Which way is up. */
  up() {
    const { map, settings } = this.stage, own = nameOfUp(map.ownUp), present = settings.up ? nameOfUp(settings.up) : own;
    const names = [...new Set([own, ...Object.keys(upAxes), present])];
    const select = element('select', { id: 'up', title: 'Heights, slopes and the view are measured against it' },
      ...names.map((name) => element('option', { value: name === own ? 'own' : name, selected: name === present },
        name === own ? `${own}, the map’s` : name)));
    select.onchange = () => this.turned(upAxes[select.value] ?? null);
    return element('div', { className: 'layer' }, element('label', { htmlFor: 'up' }, 'Up'), select);
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
    notice.hidden = missing.length === 0;
    notice.textContent = missing.join(' ');
  }

  /** @param {{title: string, place: string, rows: [string, string][]}?} what describe.js; null: nothing */
  details(what) {
    byId('details').hidden = what === null;
    if (what === null) return;
    byId('details-title').textContent = what.title;
    byId('place').textContent = what.place;
    byId('details-table').replaceChildren(...what.rows.map(([name, text]) =>
      element('tr', {}, element('th', { scope: 'row' }, name), element('td', {}, text))));
  }
}
