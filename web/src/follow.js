// The page of a map that grows: it asks the server for what has changed, and for voxels while they are shown.
import { readBlock } from './block.js';
import { takeSurfaces, takeVoxels } from './data.js';

const changesMs = 200, voxelsMs = 2000;  // from one question to the next: pictures need no more, the mapper has its processor
const latestMs = 4000;                   // until it tries to reach the server again
// A large map takes long to be drawn anew: a fifth of the time at most, so that the page stays at hand.
const restShare = 4;

/** The run whose map the page follows; null: the map is finished. */
export const runToFollow = () => document.querySelector('meta[name="octosurf-run"]')?.content ?? null;

export class Following {
  /** @param {object} page see main.js @param {string} run */
  constructor(page, run) {
    Object.assign(this, { page, run, pause: changesMs, voxelsRevision: page.map.revision });
    this.follow();
    setInterval(() => this.askForVoxels(), voxelsMs);
  }

  /** Asks again and again, but for a page that nobody sees. */
  async follow() {
    if (!document.hidden) {
      const known = new URLSearchParams({ since: this.page.map.revision, run: this.run });
      try {
        const reply = await fetch(`api/changes?${known}`);
        if (!reply.ok) throw new Error(reply.statusText);
        const json = await reply.json();
        if (json.since !== json.revision) this.take({ json });
        this.page.say('');
        this.pause = changesMs;
      } catch {
        this.page.say('The map is no longer served; this is the last that was seen of it.');
        this.pause = Math.min(latestMs, 2 * this.pause);
      }
    }
    setTimeout(() => this.follow(), this.pause);
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
    if (this.asking || document.hidden) return;
    if (!first && (!stage.settings.on.voxels || this.voxelsRevision === map.revision)) return;
    this.asking = true;
    try {
      const reply = await fetch('api/voxels');
      if (!reply.ok) return;
      const message = await readBlock(await reply.arrayBuffer());
      takeVoxels(map, message);
      this.voxelsRevision = message.json.revision;
      this.page.renewVoxels();
    } catch {  // follow() says that it is no longer served
    } finally {
      this.asking = false;
    }
  }
}
