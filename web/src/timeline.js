// Which of several maps is shown.
const playMs = 15000, quickestMs = 60, slowestMs = 1000;  // of the whole play, and of a step
const byId = (id) => document.getElementById(id);

export class Timeline {
  /** @param {object[]} maps oldest first @param {function(number): void} show */
  constructor(maps, show) {
    this.maps = maps;
    this.showMap = show;
    this.at = maps.length - 1;
    this.slider = byId('time-slider');
    byId('time').hidden = maps.length < 2;
    byId('play').hidden = maps.length < 3;
    document.body.classList.toggle('has-time', maps.length > 1);
    this.slider.max = String(maps.length - 1);
    this.slider.addEventListener('input', () => this.go(Number(this.slider.value)));
    byId('earlier').addEventListener('click', () => this.go(this.at - 1));
    byId('later').addEventListener('click', () => this.go(this.at + 1));
    byId('play').addEventListener('click', () => this.play(!this.playing));
  }

  /** As somebody asks for it: then it no longer plays. */
  go(number) {
    this.play(false);
    this.show(number);
  }

  show(number) {
    this.at = Math.min(this.maps.length - 1, Math.max(0, number));
    this.slider.value = String(this.at);
    byId('time-name').textContent = `${this.maps[this.at].name} (${this.at + 1} of ${this.maps.length})`;
    byId('earlier').disabled = this.at === 0;
    byId('later').disabled = this.at === this.maps.length - 1;
    this.showMap(this.at);
  }

  /** From where it is to the end; from the beginning, if that is the end. */
  play(on) {
    clearInterval(this.playing);
    this.playing = undefined;
    byId('play').setAttribute('aria-pressed', String(on));
    if (!on) return;
    if (this.at === this.maps.length - 1) this.show(0);
    const stepMs = Math.min(slowestMs, Math.max(quickestMs, playMs / this.maps.length));
    this.playing = setInterval(() => {
      if (this.at === this.maps.length - 1) this.play(false);
      else this.show(this.at + 1);
    }, stepMs);
  }
}
