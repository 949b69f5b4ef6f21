// What the keyboard does, and the list of it.
import { element } from './panel.js';

const turnDeg = 6;

/** @param {object} page the parts, see main.js */
export function bindKeys(page) {
  const { view, actions } = page;
  const keys = [
    { keys: ['1', '2', '3', '4', '5', '6', '7', '8', '9', '0'], text: 'a layer on or off, as listed',
      act: (key) => actions.layer((Number(key) + 9) % 10) },
    { keys: ['ArrowLeft'], name: '← → ↑ ↓', text: 'turn', act: () => view.orbit(-turnDeg, 0) },
    { keys: ['ArrowRight'], act: () => view.orbit(turnDeg, 0) },
    { keys: ['ArrowUp'], act: () => view.orbit(0, turnDeg) },
    { keys: ['ArrowDown'], act: () => view.orbit(0, -turnDeg) },
    { keys: ['+', '='], name: '+ −', text: 'nearer, farther', act: () => view.orbit(0, 0, 0.85) },
    { keys: ['-'], act: () => view.orbit(0, 0, 1 / 0.85) },
    { keys: ['f'], text: 'the whole map', act: actions.fit },
    { keys: ['v'], text: 'from above', act: actions.top },
    { keys: ['m'], text: 'measure between two points', act: actions.measure },
    { keys: ['/'], text: 'find an id', act: actions.search },
    { keys: ['b'], text: 'surfaces seen from behind', act: actions.backs },
    { keys: ['['], name: '[ ]', text: 'the map before, the next', act: actions.earlier },
    { keys: [']'], act: actions.later },
    { keys: ['r'], text: 'run through them', act: actions.play },
    { keys: ['t'], text: 'light or dark', act: actions.theme },
    { keys: ['p'], text: 'the panel', act: actions.panel },
    { keys: ['Escape'], name: 'Esc', text: 'nothing picked or measured', act: actions.clear },
    { keys: ['?'], text: 'this list', act: actions.help },
  ];
  const names = (entry) => entry.name ?? (entry.keys.length > 2 ? '1 … 0' : entry.keys[0]);
  document.getElementById('keys').replaceChildren(...keys.filter(({ text }) => text).map((entry) =>
    element('div', {}, element('kbd', {}, names(entry)), entry.text)));
  document.addEventListener('keydown', (event) => {
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== 'checkbox';
    if (event.ctrlKey || event.metaKey || event.altKey || (typing && event.key !== 'Escape')) return;
    const entry = keys.find((one) => one.keys.includes(event.key));
    if (!entry) return;
    event.preventDefault();
    entry.act(event.key);
  });
}
