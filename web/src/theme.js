// Light or dark: as the reader's system says, until the button says otherwise.
export class Theme {
  /** @param {function(): void} changed */
  constructor(changed) {
    this.button = document.getElementById('theme');
    const system = window.matchMedia('(prefers-color-scheme: dark)');
    this.changed = () => {};  // nothing is there yet that could
    this.set(system.matches);
    this.changed = changed;
    system.addEventListener('change', () => this.set(system.matches));
    this.button.addEventListener('click', () => this.set(!this.dark));
  }

  set(dark) {
    this.dark = dark;
    document.documentElement.dataset.theme = dark ? 'dark' : 'light';
    this.button.textContent = dark ? 'Light' : 'Dark';
    this.changed();
  }

  get paper() { return this.dark ? 0x15181c : 0xf5f5f2; }
  get ink() { return this.dark ? [0.85, 0.87, 0.9] : [0.12, 0.13, 0.15]; }
  get grid() { return this.dark ? [0.25, 0.27, 0.3] : [0.8, 0.81, 0.82]; }
}
