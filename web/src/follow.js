// The page of a map that grows: is told over a WebSocket what changes, and asks for voxels while it shows them.
import { readBlock } from './block.js';
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
    this.reading = Promise.resolve();
    this.connect();
    setInterval(() => this.askForVoxels(), 500);
  }

  connect() {
    const known = new URLSearchParams({ since: this.page.map.revision, run: this.run });
    const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/live?${known}`);
    socket.binaryType = 'arraybuffer';
    socket.addEventListener('open', () => {
      this.socket = socket;
      this.pause = soonestMs;
      this.voxelsAsked = false;
      this.page.hush();
    });
    socket.addEventListener('message', ({ data }) => {
      // One after the other: unpacking takes its time, and changes count on those before.
      this.reading = this.reading.then(async () => this.take(await readBlock(data), data.byteLength))
        .catch((error) => this.page.say(`What the server told cannot be read: ${error.message}`));
    });
    socket.addEventListener('close', () => {
      this.socket = null;
      this.page.say('The map is no longer served; this is the last that was seen of it.');
      setTimeout(() => this.connect(), this.pause);
      this.pause = Math.min(latestMs, 2 * this.pause);
    });
  }

  /** @param {number} bytes of the message: for tests */
  take(block, bytes) {
    const { page } = this;
    if (block.json.kind === 'changes') {
      takeChanges(page.map, block);
      this.run = block.json.run;
      if (block.json.since === null) this.voxelsRevision = -1;
      this.told = { messages: (this.told?.messages ?? 0) + 1, bytes, whole: block.json.since === null };
      this.drawSoon();
    } else {
      takeVoxels(page.map, block);
      this.voxelsRevision = block.json.revision;
      this.voxelsAsked = false;
      this.voxelsMs = performance.now() - this.voxelsAt;
      page.renewVoxels();
    }
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
  askForVoxels() {
    const { stage, map } = this.page, first = map.voxels === null && map.surfaces.length > 0;
    const wanted = first || ['voxels', 'pending', 'slice'].some((id) => stage.settings.on[id]);
    const rest = Math.max(leastVoxelsMs, restShare * (this.voxelsMs ?? 0));
    if (!this.socket || !wanted || this.voxelsAsked || performance.now() - this.voxelsAt < rest) return;
    if (!first && this.voxelsRevision === map.revision && (map.slices || !stage.settings.on.slice)) return;
    this.socket.send(first || stage.settings.on.slice ? 'slices' : 'voxels');
    this.voxelsAsked = true;
    this.voxelsAt = performance.now();
  }
}
