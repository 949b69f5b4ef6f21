// The page of a map that grows: the server sends changes as events; voxels are requested while they are shown.
import { readBlock, readTextBlock } from './block.js';
import { takeSurfaces, takeVoxels } from './data.js';

const soonestMs = 250, latestMs = 4000;  // until it tries to reach the server again
const voxelsMs = 2000;                   // from one question for voxels to the next
// A large map takes long to be drawn anew: a fifth of the time at most, so that the page stays at hand.
const restShare = 4;

export class Following {
  /** @param {object} page see main.js @param {string} run */
  constructor(page, run) {
    Object.assign(this, { page, run, pause: soonestMs, voxelsRevision: page.map.revision, reading: Promise.resolve() });
    this.connect();
    // A browser has few connections to a server: pages that nobody sees leave them to others.
    document.addEventListener('visibilitychange', () => (document.hidden ? this.disconnect() : this.connect()));
    setInterval(() => this.askForVoxels(), voxelsMs);
  }

  connect() {
    this.disconnect();
    const known = new URLSearchParams({ since: this.page.map.revision, run: this.run });
    const events = this.events = new EventSource(`live?${known}`);
    events.addEventListener('open', () => {
      this.pause = soonestMs;
      this.page.say('');
    });
    events.addEventListener('changes', ({ data }) => {
      // One after the other: unpacking takes its time, and changes count on those before.
      this.reading = this.reading.then(async () => this.take(await readTextBlock(data)))
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

  take(message) {
    takeSurfaces(this.page.map, message);
    this.run = message.json.run;
    const whole = message.json.since === null;
    if (whole) this.voxelsRevision = -1;
    this.told = { messages: (this.told?.messages ?? 0) + 1, whole };  // for tests
    this.drawing ??= setTimeout(() => this.draw());
  }

  /** What comes meanwhile and for a while after is drawn at once with it. */
  draw() {
    const { page } = this, begin = performance.now(), { revision } = page.map;
    page.renewSurfaces();
    this.drawing = setTimeout(() => {
      this.drawing = undefined;
      if (page.map.revision !== revision) this.draw();
    }, restShare * (performance.now() - begin));
  }

  /** All voxels are many: requested while they are visible, and once in any case, for their layer to be there. */
  async askForVoxels() {
    const { stage, map } = this.page, first = map.voxels === null && map.surfaces.length > 0;
    if (this.asking || this.events.readyState !== EventSource.OPEN) return;
    if (!first && (!stage.settings.on.voxels || this.voxelsRevision === map.revision)) return;
    this.asking = true;
    try {
      const reply = await fetch('api/voxels');
      if (!reply.ok) return;
      const message = await readBlock(await reply.arrayBuffer());
      takeVoxels(map, message);
      this.voxelsRevision = message.json.revision;
      this.page.renewVoxels();
    } catch {  // the events say that it is no longer served
    } finally {
      this.asking = false;
    }
  }
}
