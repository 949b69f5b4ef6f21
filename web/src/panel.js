// The panel at the side: layers with their switches and choices, the legend, what was picked.
import { layers } from './layers/index.js';
import { css } from './shading.js';

/** @param {string} tag @param {object} properties @param {(Node|string)[]} children */
export function element(tag, properties = {}, ...children) {
  const result = Object.assign(document.createElement(tag), properties);
  result.append(...children);
  return result;
}

const byId = (id) => document.getElementById(id);
const thousands = (number) => number.toLocaleString('en').replaceAll(',', '\u202f');

function choiceOf(layer, stage, changed) {
  const choices = layer.choices?.(stage.map) ?? [];
  if (choices.length < 2) return [];
  const select = element('select', { ariaLabel: `${layer.label}: colours` });
  for (const { id, label } of choices) select.append(element('option', { value: id, textContent: label }));
  const chosen = stage.settings.choice[layer.id];
  if (choices.some(({ id }) => id === chosen)) select.value = chosen;
  select.addEventListener('change', () => {
    stage.choose(layer.id, select.value);
    changed();
  });
  return [select];
}

function rangeOf(layer, stage) {
  if (!layer.range || !stage.settings.on[layer.id]) return [];
  const range = layer.range(stage.map, stage.settings);
  const text = element('span', { className: 'value', textContent: range.text(range.value) });
  const slider = element('input', {
    type: 'range', min: range.least, max: range.greatest, step: 1, value: range.value,
    id: `range-${layer.id}`, ariaLabel: `${layer.label}: height`,
  });
  slider.addEventListener('input', () => {
    range.set(Number(slider.value));
    text.textContent = range.text(Number(slider.value));
    stage.renew(layer.id);
  });
  return [element('div', { className: 'range' }, slider, text)];
}

function rowOf(layer, number, stage, changed) {
  const box = element('input', { type: 'checkbox', id: `layer-${layer.id}`, checked: stage.settings.on[layer.id] });
  box.addEventListener('change', () => {
    stage.switch(layer.id, box.checked);
    changed();
  });
  const label = element('label', { htmlFor: box.id, title: `${layer.label} (${number % 10})` }, layer.label);
  const count = layer.count?.(stage.map, stage.context);
  if (count !== undefined) label.append(element('small', { textContent: ` ${thousands(count)}` }));
  return element('div', { className: 'layer' }, box, label, ...choiceOf(layer, stage, changed), ...rangeOf(layer, stage));
}

function legendEntry({ color, line, ramp, text, low, high }) {
  if (ramp) {
    const bar = element('span', { className: 'ramp' });
    bar.style.background = ramp;
    return element('div', { className: 'entry wide' }, element('span', {}, low), bar, element('span', {}, high));
  }
  const swatch = element('span', { className: line ? 'line' : 'swatch' });
  if (color || line) swatch.style.background = css(color ?? line);
  else swatch.style.visibility = 'hidden';
  return element('div', { className: 'entry' }, swatch, element('span', {}, text));
}

export class Panel {
  /** @param {import('./stage.js').Stage} stage */
  constructor(stage) {
    this.stage = stage;
    this.folded = () => {};
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
      .map(([layer, number]) => rowOf(layer, number, stage, () => this.update()));
    byId('layers').replaceChildren(...rows, this.backs());
    byId('legend').replaceChildren(...layers.filter((layer) => stage.shows(layer.id))
      .flatMap((layer) => layer.legend?.(map, stage.context) ?? []).map(legendEntry));
  }

  /** Walls and ceilings hide a room from outside. */
  backs() {
    const { stage } = this, { cut } = stage.context;
    const box = element('input', { type: 'checkbox', id: 'backs', checked: !cut.value });
    box.addEventListener('change', () => {
      cut.value = !box.checked;
      stage.view.redraw();
    });
    return element('div', { className: 'layer' }, box,
      element('label', { htmlFor: 'backs', title: 'Surfaces seen from behind (b)' }, 'Seen from behind, too'));
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
    if (map.momentsLeftOut > 0)
      missing.push(`${map.momentsLeftOut} of the history’s moments do not fit into it (view --max-mb).`);
    notice.hidden = missing.length === 0;
    notice.textContent = missing.join(' ');
  }

  /**
   * @param {string?} title null: nothing is picked
   * @param {import('./describe.js').Row[]} rows
   * @param {function(string): void} goTo an id
   */
  details(title, rows, goTo) {
    byId('details').hidden = title === null;
    if (title === null) return;
    byId('details-title').textContent = title;
    byId('details-table').replaceChildren(...rows.map(({ name, text, ids }) => {
      const cell = element('td', {}, ...(ids ? [] : [text]));
      for (const one of ids ?? []) {
        const button = element('button', { className: 'id', textContent: one.text });
        button.addEventListener('click', () => goTo(one.id));
        cell.append(button);
      }
      return element('tr', {}, element('th', { scope: 'row' }, name), cell);
    }));
  }
}
