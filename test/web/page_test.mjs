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

/** Where a place of the map is in the picture; it has to be the surface that is seen there. */
async function onSurface(page, place, id) {
  const at = await page.value(`(() => {
    const place = ${JSON.stringify(place)}.map((x, k) => x - page.map.origin[k]);
    const { x, y } = page.view.project(place);
    return { x, y, id: page.hit(x, y)?.what.id };
  })()`);
  assert.equal(at.id, id, `${place} is to be seen`);
  return at;
}

const different = (a, b) => Math.max(...a.map((x, k) => Math.abs(x - b[k]))) > 25;

/** Contact regions of two feet, and plans, as make_pages knows them. */
async function feetAndPlans(browser) {
  const page = await browser.open(join(folder, 'room.html'));
  await page.ready();
  await page.press('#top');
  const middle = await onSurface(page, [5, 2.4, 0], 2), nearWall = await onSurface(page, [3, 0.12, 0], 2);
  const bare = await page.colors([middle, nearWall]);
  await page.press('#layer-regions');
  assert.match(await page.text('#legend'), /the middle of a foot may be here: large/);
  const large = await page.colors([middle, nearWall]);
  assert.deepEqual([0, 1].map((i) => different(bare[i], large[i])), [true, false], 'the large foot keeps off the wall');
  await page.value(`(() => {
    const select = document.querySelector('select[aria-label^="Contact regions"]');
    select.value = 'small';
    select.dispatchEvent(new Event('change'));
  })()`);
  const small = await page.colors([middle, nearWall]);
  assert.ok(different(bare[1], small[1]), 'the small foot may go to it');
  await page.click(middle.x, middle.y);
  assert.match(await page.text('#details-table'), /its middle may be on 22\.3\d+ m² \(small\)/);
  await page.press('#search-text');
  await page.type('8');
  await page.key('Enter');
  assert.match(await page.text('#details-table'), /nowhere: slope/);
  await page.key('Escape');
  await page.press('#layer-regions');
  await page.press('#top');

  // Toes, where no number is written.
  const toes = [await onSurface(page, [4.1, 0.96, 0], 2), await onSurface(page, [4.5, 0.66, 0], 2)];
  const [left, right] = await page.colors(toes);
  assert.ok(left[0] > left[1] + 50, `a left foot is red: ${left}`);
  assert.ok(right[1] > right[0] + 50, `a right foot is green: ${right}`);
  const legend = await page.text('#legend');
  assert.match(legend, /across: 3 steps/);
  assert.match(legend, /nowhere: no plan: the robot cannot stand <b>there<\/b>/);
  await page.press('#layer-plans');
  const [without] = await page.colors(toes);
  assert.ok(different(left, without), 'plans can be switched off');
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

/** Surfaces come, change and go as the slider moves. */
async function aHistory(browser) {
  const page = await browser.open(join(folder, 'history.html'));
  await page.ready();
  const ids = () => page.value('page.map.surfaces.map((s) => s.id)');
  const now = await ids(), newest = now.at(-1);
  const slideTo = (number) => page.value(`(() => {
    const slider = document.getElementById('time-slider');
    slider.value = '${number}';
    slider.dispatchEvent(new Event('input'));
  })()`).then(() => page.settled());
  assert.match(await page.text('#time-name'), /^room with a past \(4 of 4\)/);
  assert.equal(await page.visible('#layer-gone').catch(() => false), false, 'the map itself is shown as it is');

  await slideTo(0);
  assert.match(await page.text('#time-name'), /^revision 500, after 0\.0 s \(1 of 4\)/);
  assert.deepEqual(await ids(), now.filter((id) => id !== newest));
  assert.match(await page.text('#legend'), /appeared/);
  const height = (id) => page.value(`page.map.toMap(page.map.surface(${id}).origin)[2]`);
  const low = await height(20);

  await slideTo(1);
  assert.match(await page.text('#time-name'), /^revision 600, after 2\.5 s/);
  assert.ok((await ids()).includes(99), 'a surface that is no more');
  await page.press('#top');
  const [visitor] = await page.value(seen(99));
  const [r, g, b] = (await page.colors([visitor]))[0];
  assert.ok(g > r + 40 && g > b + 40, `what appeared is green: ${[r, g, b]}`);
  await page.click(visitor.x, visitor.y);
  assert.match(await page.text('#details-table'), /appeared.*revision 600.*since before.*appeared/);

  await slideTo(2);
  assert.equal(await page.visible('#details'), false);
  assert.ok(!(await ids()).includes(99));
  const [red, green] = (await page.colors([visitor]))[0];
  assert.ok(red > green + 25, `what went is a shade of red: ${[red, green]}`);

  await slideTo(3);
  assert.deepEqual(await ids(), now);
  assert.ok(Math.abs(await height(20) - low - 0.1) < 1e-6, 'the table has been put up');
  await page.press('#play');
  assert.match(await page.text('#time-name'), /\([12] of 4\)/, 'it plays from the beginning');
  await page.until('page.timeline.at === 3 && !page.timeline.playing');
  await page.key('[');
  assert.match(await page.text('#time-name'), /^revision 700/);
  assert.deepEqual(page.errors, []);
  assert.deepEqual(page.fetched, [], 'nothing is fetched');
}

async function touched(browser) {
  const page = await browser.open(join(folder, 'room.html'), { width: 800, height: 900, touch: true });
  await page.ready();
  const { id, at } = await someSurface(page);
  await page.tap(at.x, at.y);
  assert.equal(await page.text('#details-title'), `Surface ${id}`);
  assert.deepEqual(page.errors, []);
}

/** Turns for a while. @returns {Promise<number>} pictures a second */
function turn(page) {
  return page.value(`new Promise((done) => {
    const starts = [];
    const step = (now) => {
      starts.push(now);
      if (starts.length > 60)  // the first pictures are those that the page learns from
        return done(40000 / (starts[60] - starts[20]));
      page.view.orbit(2, 0);
      return requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  })`);
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
  const turning = await turn(page);
  const first = await page.value('page.view.firstPictureMs') / 1000;
  console.log(`1 000 000 voxels: a picture after ${first.toFixed(1)} s, whole after ${(loaded / 1000).toFixed(1)} s, ${frame.toFixed(0)} ms a picture at rest, ${
    turning.toFixed(0)} pictures a second while turning, without a GPU`);
  const drawnAfter = (frameMs) => page.value(`(() => {
    for (let i = 0; i < 60; ++i) page.stage.effort.note(${frameMs}, false);
    page.stage.effort.share([page.stage.objects.get('voxels')], true);
    return page.stage.objects.get('voxels').geometry.drawRange.count;
  })()`);
  assert.ok(await drawnAfter(500) < 10000, 'what takes too long is drawn coarser');
  assert.equal(await drawnAfter(5), 1000000, 'what is quick is drawn whole');
  await page.value('page.view.redraw()');
  await page.until('!page.view.asked && !page.view.moving', 120);
  assert.equal(await page.value('page.stage.objects.get("voxels").geometry.drawRange.count'), 1000000, 'whole at rest');
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
  for (const test of [aRoom, feetAndPlans, twoMaps, aHistory, touched, large, nothing]) {
    await test(browser);
    console.log(`${test.name}: well`);
  }
} finally {
  await browser.close();
}
