// The page of a map that grows: the server sends changes as events; voxels are requested while they are shown.
import { readBlock, readTextBlock } from './block.js';
import { takeChanges, takeVoxels } from './data.js';

const soonestMs = 250, latestMs = 4000;  // until it tries to reach the server again
// A large map takes long to be drawn anew: a fifth of the time at most, so that the page stays at hand.
const restShare = 4;
const leastVoxelsMs = 2000;

export class Following {
  /** @param {object} page see main.js @param {string} run */
  constructor(page, run) {
    this.page = page;
    this.run = run;
    this.pause = soonestMs;
    this.voxelsAt = -Infinity;
    this.voxelsRevision = page.map.revision;
    this.voxels = null;  // that are not drawn yet
    this.reading = Promise.resolve();
    this.connect();
    // A browser has few connections to a server: pages that nobody sees leave them to others.
    document.addEventListener('visibilitychange', () => (document.hidden ? this.disconnect() : this.connect()));
    setInterval(() => this.askForVoxels(), 500);
  }

  connect() {
    this.disconnect();
    const known = new URLSearchParams({ since: this.page.map.revision, run: this.run });
    const events = this.events = new EventSource(`live?${known}`);
    events.addEventListener('open', () => {
      this.pause = soonestMs;
      this.page.hush();
    });
    events.addEventListener('changes', ({ data }) => {
      // One after the other: unpacking takes its time, and changes count on those before.
      this.reading = this.reading.then(async () => this.take(await readTextBlock(data), data.length))
        .catch((error) => this.page.say(`What the server sent cannot be read: ${error.message}`));
    });
    // EventSource would reconnect with the first URL, and so with an old revision.
    events.addEventListener('error', () => {
      this.disconnect();
      this.page.say('The map is no longer served; this is the last that was seen of it.');
      this.again = setTimeout(() => this.connect(), this.pause);
      this.pause = Math.min(latestMs, 2 * this.pause);
    });
  }

  disconnect() {
    clearTimeout(this.again);
    this.events?.close();
  }

  /** @param {number} bytes of the event: for tests */
  take(block, bytes) {
    const { page } = this;
    takeChanges(page.map, block);
    this.run = block.json.run;
    if (block.json.since === null) [this.voxels, this.voxelsRevision] = [null, -1];
    this.told = { messages: (this.told?.messages ?? 0) + 1, bytes, whole: block.json.since === null };
    this.drawSoon();
    this.takeVoxels();
  }

  /** Voxels are of surfaces that the page should know: they wait for the changes that come before. */
  takeVoxels() {
    const block = this.voxels, { page } = this;
    if (!block || block.json.revision > page.map.revision) return;
    this.voxels = null;
    takeVoxels(page.map, block);
    this.voxelsRevision = block.json.revision;
    this.voxelsMs = performance.now() - this.voxelsAt;
    page.renewVoxels();
  }

  /** Draws what has changed; what comes meanwhile and for a while after is drawn at once with it. */
  drawSoon() {
    if (this.drawing) return;
    this.drawing = setTimeout(() => {
      const begin = performance.now();
      this.page.renewSurfaces();
      const took = performance.now() - begin;
      this.drawing = setTimeout(() => {
        this.drawing = undefined;
        if (this.page.map.revision !== this.drawn) this.drawSoon();
      }, restShare * took);
      this.drawn = this.page.map.revision;
    });
  }

  /**
   * All voxels are many: asked for while they are to be seen, and not sooner than drawing them lets the page rest. Once
   * they are wanted in any case: before there are any, their layers cannot be switched on.
   */
  async askForVoxels() {
    const { stage, map } = this.page, first = map.voxels === null && map.surfaces.length > 0;
    const wanted = first || ['voxels', 'pending', 'slice'].some((id) => stage.settings.on[id]);
    const rest = Math.max(leastVoxelsMs, restShare * (this.voxelsMs ?? 0));
    const connected = this.events.readyState === EventSource.OPEN;
    if (!connected || !wanted || this.voxels || this.asking || performance.now() - this.voxelsAt < rest) return;
    if (!first && this.voxelsRevision === map.revision && (map.slices || !stage.settings.on.slice)) return;
    this.asking = true;
    this.voxelsAt = performance.now();
    try {
      const reply = await fetch(`api/voxels?slices=${first || stage.settings.on.slice ? 1 : 0}`);
      if (reply.ok) this.voxels = await readBlock(await reply.arrayBuffer());
      this.takeVoxels();
    } catch {  // the events say that it is no longer served
    } finally {
      this.asking = false;
    }
  }
}
