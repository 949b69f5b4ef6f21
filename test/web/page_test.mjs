// page_test.mjs PAGES: what a person does with the pages of make_pages, in a real browser.
import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { Browser, chromium, skipped } from './browser.mjs';

const folder = process.argv[2];
const program = chromium();
if (!program) {
  console.log('skipped: no Chromium');
  process.exit(skipped);
}
if (!existsSync(folder)) {
  console.log('skipped: built without the page, so that there are none to look at');
  process.exit(skipped);
}

/** Places of the picture at which a surface is seen: middles of its triangles that nothing hides. */
const seen = (id) => `(() => {
  const s = page.map.surface(${id}), places = [];
  for (let i = 0; i < s.corners.length; i += 3) {
    const [a, b, c] = s.corners.subarray(i, i + 3);
    const u = (s.u[a] + s.u[b] + s.u[c]) / 3, v = (s.v[a] + s.v[b] + s.v[c]) / 3;
    const place = [0, 1, 2].map((k) => s.origin[k] + s.axes[0][k] * u + s.axes[1][k] * v);
    const { x, y, visible } = page.view.project(place);
    if (visible && page.hit(x, y)?.what === s) places.push({ x, y });
  }
  return places;
})()`;

async function someSurface(page) {
  for (const id of await page.value('page.map.surfaces.map((s) => s.id)')) {
    const places = await page.value(seen(id));
    const box = await page.value('document.getElementById("panel").getBoundingClientRect().right');
    const clear = places.filter(({ x, y }) => x > box + 20 && y > 20);
    if (clear.length > 0) return { id, at: clear[0] };
  }
  throw new Error('no surface is to be seen');
}

async function aRoom(browser) {
  const page = await browser.open(join(folder, 'room.html'));
  await page.ready();
  assert.equal(await page.value('window.injected'), undefined, 'a map\'s name is text');
  assert.match(await page.text('#summary'), /\d+ surfaces/);
  const { id, at } = await someSurface(page);

  await page.hover(at.x, at.y);
  assert.match(await page.text('#tip'), new RegExp(`surface ${id} `));
  await page.click(at.x, at.y);
  assert.equal(await page.text('#details-title'), `Surface ${id}`);
  assert.match(await page.text('#details-table'), /m²/);
  await page.key('Escape');
  assert.equal(await page.visible('#details'), false);

  await page.press('#search-text');
  await page.type(String(id));
  await page.key('Enter');
  assert.equal(await page.text('#details-title'), `Surface ${id}`);
  await page.key('Escape');

  // What is switched off is neither drawn nor picked.
  const [drawn] = await page.colors([at]);
  await page.press('#fit');
  await page.press('#layer-surfaces');
  const place = (await someSurface(page).catch(() => null));
  assert.equal(place, null, 'no surface can be picked');
  await page.press('#layer-surfaces');
  const again = await someSurface(page);
  const [color] = await page.colors([again.at]);
  const [r, g, b] = color;
  assert.ok(Math.max(r, g, b) - Math.min(r, g, b) > 8 || drawn.some((part) => part < 200), 'a surface has its colour');

  await page.press('#measure');
  await page.click(again.at.x, again.at.y);
  const far = (await page.value(seen(again.id))).at(-1);
  await page.click(far.x, far.y);
  if (Math.hypot(far.x - again.at.x, far.y - again.at.y) > 5)
    assert.match(await page.text('#measure-label'), /^\d+\.\d{3} m: /);
  assert.deepEqual(page.errors, []);
  assert.deepEqual(page.fetched, [], 'nothing is fetched');
}

async function twoMaps(browser) {
  const page = await browser.open(join(folder, 'two.html'), { dark: true });
  await page.ready();
  assert.match(await page.text('#time-name'), /^tuesday \(2 of 2\)/);
  const later = await page.value('page.map.surfaces.map((s) => s.id)');
  await page.press('#earlier');
  assert.match(await page.text('#time-name'), /^monday \(1 of 2\)/);
  assert.notDeepEqual(await page.value('page.map.surfaces.map((s) => s.id)'), later);
  await page.press('#later');
  assert.match(await page.text('#time-name'), /^tuesday/);
  assert.deepEqual(page.errors, []);
}

async function touched(browser) {
  const page = await browser.open(join(folder, 'room.html'), { width: 800, height: 900, touch: true });
  await page.ready();
  const { id, at } = await someSurface(page);
  await page.tap(at.x, at.y);
  assert.equal(await page.text('#details-title'), `Surface ${id}`);
  assert.deepEqual(page.errors, []);
}

/** A million voxels and five hundred surfaces: loads and turns. */
async function large(browser) {
  const start = performance.now();
  const page = await browser.open(join(folder, 'hills.html'));
  await page.ready();
  const loaded = performance.now() - start;
  assert.equal(await page.value('page.map.voxels.count'), 1000000);
  await page.press('#layer-voxels');
  const frame = await page.value(`(() => {
    const start = performance.now();
    const gl = page.view.renderer.getContext(), pixel = new Uint8Array(4);
    for (let i = 0; i < 5; ++i) {
      page.view.draw();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);  // waits for the picture
    }
    return (performance.now() - start) / 5;
  })()`);
  console.log(`1 000 000 voxels: there after ${(loaded / 1000).toFixed(1)} s, ${frame.toFixed(0)} ms a frame without a GPU`);
  assert.deepEqual(page.errors, []);
  const small = await browser.open(join(folder, 'small.html'));
  await small.ready();
  assert.ok(await small.visible('#notice'), 'a page that leaves detail out says so');
  assert.ok(await small.value('page.map.voxels.count') < 1000000);
  assert.equal(await page.visible('#notice'), false);
}

async function nothing(browser) {
  for (const name of ['empty', 'turned']) {
    const page = await browser.open(join(folder, `${name}.html`));
    await page.ready();
    assert.equal(await page.visible('#message'), false);
    assert.deepEqual(page.errors, []);
  }
}

const browser = new Browser(program);
try {
  for (const test of [aRoom, twoMaps, touched, large, nothing]) {
    await test(browser);
    console.log(`${test.name}: well`);
  }
} finally {
  await browser.close();
}
