// Which of several maps is shown.
export class Timeline {
  /** @param {object[]} maps oldest first @param {function(number): void} show */
  constructor(maps, show) {
    this.maps = maps;
    this.showMap = show;
    this.at = maps.length - 1;
    this.slider = document.getElementById('time-slider');
    document.getElementById('time').hidden = maps.length < 2;
    document.body.classList.toggle('has-time', maps.length > 1);
    this.slider.max = String(maps.length - 1);
    this.slider.addEventListener('input', () => this.show(Number(this.slider.value)));
    document.getElementById('earlier').addEventListener('click', () => this.show(this.at - 1));
    document.getElementById('later').addEventListener('click', () => this.show(this.at + 1));
  }

  show(number) {
    this.at = Math.min(this.maps.length - 1, Math.max(0, number));
    this.slider.value = String(this.at);
    document.getElementById('time-name').textContent =
      `${this.maps[this.at].name} (${this.at + 1} of ${this.maps.length})`;
    document.getElementById('earlier').disabled = this.at === 0;
    document.getElementById('later').disabled = this.at === this.maps.length - 1;
    this.showMap(this.at);
  }
}
