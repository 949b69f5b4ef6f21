// The page of a map that grows: asks whether it has changed, and takes it anew.
import { readMap } from './data.js';

const pause = (ms) => new Promise((done) => { setTimeout(done, ms); });
const leastPauseMs = 1000;

/** @param {object} page see main.js; until it is closed */
export async function follow(page) {
  for (;;) {
    const begin = performance.now();
    try {
      const { revision } = await (await fetch('/api/info')).json();
      if (revision !== page.map.revision) {
        const text = await (await fetch('/')).text();
        const block = new DOMParser().parseFromString(text, 'text/html').querySelector('script.map');
        page.take(await readMap(block.textContent, page.map.origin));
      }
    } catch {
      page.say('The map is no longer served; this is the last that was seen of it.');
      return;
    }
    // A large map takes seconds to be read: a fifth of the time at most, so that the page stays at hand.
    await pause(Math.max(leastPauseMs, 4 * (performance.now() - begin)));
  }
}
