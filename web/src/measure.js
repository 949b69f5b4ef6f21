// The distance between two places that the reader picks.
export class Measure {
  /** @param {import('./view.js').View} view @param {import('./highlight.js').Highlight} highlight */
  constructor(view, highlight) {
    this.view = view;
    this.highlight = highlight;
    this.button = document.getElementById('measure');
    this.label = document.getElementById('measure-label');
    this.on = false;
    this.places = [];
    this.button.addEventListener('click', () => this.set(!this.on));
    view.afterPicture.push(() => this.placeLabel());
  }

  set(on) {
    this.on = on;
    this.button.setAttribute('aria-pressed', String(on));
    this.view.canvas.classList.toggle('measuring', on);
    if (on) this.show([]);
  }

  clear() {
    this.set(false);
    this.show([]);
  }

  /** @param {number[]} place root coordinates @param {number[]} up */
  add(place, up) {
    this.up = up;
    this.show([...(this.places.length === 2 ? [] : this.places), place]);
  }

  show(places) {
    this.places = places;
    this.highlight.measured(places);
    this.label.hidden = places.length < 2;
    if (places.length === 2) this.label.textContent = this.text();
    this.placeLabel();
  }

  text() {
    const [a, b] = this.places, way = b.map((x, k) => x - a[k]);
    const height = way.reduce((sum, x, k) => sum + x * this.up[k], 0), distance = Math.hypot(...way);
    const level = Math.sqrt(Math.max(0, distance * distance - height * height));
    return `${distance.toFixed(3)} m: ${level.toFixed(3)} level, ${height < 0 ? '−' : '+'}${Math.abs(height).toFixed(3)} up`;
  }

  placeLabel() {
    if (this.places.length < 2) return;
    const [a, b] = this.places;
    const { x, y, visible } = this.view.project(a.map((value, k) => (value + b[k]) / 2));
    this.label.hidden = !visible;
    this.label.style.transform = `translate(-50%, -130%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
  }
}
