// What the keyboard does, and the list of it. Most keys press a button.
import { layers } from './layers/index.js';
import { element } from './panel.js';

const turnDeg = 6;

/** @param {object} page see main.js */
export function bindKeys(page) {
  const { view, stage, panel } = page, press = (id) => () => document.getElementById(id).click();
  const toggleLayer = (key) => {
    const layer = layers[(Number(key) + 9) % 10];
    if (!layer || !stage.has(layer)) return;
    stage.switch(layer.id);
    panel.update();
  };
  const clear = () => {
    document.activeElement?.blur();
    page.clear();
  };
  const keys = [
    ['1234567890', '1 … 0', 'a layer on or off, as listed', toggleLayer],
    [['ArrowLeft'], '← → ↑ ↓', 'turn', () => view.orbit(-turnDeg, 0)],
    [['ArrowRight'], '', '', () => view.orbit(turnDeg, 0)],
    [['ArrowUp'], '', '', () => view.orbit(0, turnDeg)],
    [['ArrowDown'], '', '', () => view.orbit(0, -turnDeg)],
    ['+=', '+ −', 'nearer, farther', () => view.orbit(0, 0, 0.85)],
    ['-', '', '', () => view.orbit(0, 0, 1 / 0.85)],
    ['f', 'f', 'the whole map', press('fit')],
    ['v', 'v', 'from above', press('top')],
    ['m', 'm', 'measure between two points', press('measure')],
    ['/', '/', 'find an id', () => document.getElementById('search-text').focus()],
    ['b', 'b', 'surfaces seen from behind', press('backs')],
    ['t', 't', 'light or dark', press('theme')],
    ['p', 'p', 'the panel', press('fold')],
    [['Escape'], 'Esc', 'nothing picked or measured', clear],
    ['?', '?', 'this list', press('help')],
  ];
  document.getElementById('keys').replaceChildren(...keys.filter(([, name]) => name).map(([, name, text]) =>
    element('div', {}, element('kbd', {}, name), text)));
  document.addEventListener('keydown', (event) => {
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== 'checkbox';
    if (event.ctrlKey || event.metaKey || event.altKey || (typing && event.key !== 'Escape')) return;
    const found = keys.find(([known]) => [...known].includes(event.key));
    if (!found) return;
    event.preventDefault();
    found[3](event.key);
  });
}
