// page_test.mjs PAGES [COMMAND MAP]: what a person does with the pages of make_pages, and with those that the command
// serves, in a real browser.
import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { runInBrowser, skip } from './browser.mjs';
import { asks, followsTheMap } from './live_pages.mjs';

const [folder, command] = process.argv.slice(2);
if (!existsSync(folder)) skip('built without the page, so that there are none to look at');

/** Places of the picture at which a surface is seen: middles of its triangles that nothing hides. */
const seen = (id) => `(() => {
  const s = page.map.surface(${id}), places = [], panel = document.getElementById('panel').getBoundingClientRect().right;
  for (let i = 0; i < s.corners.length; i += 3) {
    const [a, b, c] = s.corners.subarray(i, i + 3);
    const u = (s.u[a] + s.u[b] + s.u[c]) / 3, v = (s.v[a] + s.v[b] + s.v[c]) / 3;
    const place = [0, 1, 2].map((k) => s.origin[k] + s.axes[0][k] * u + s.axes[1][k] * v);
    const { x, y, visible } = page.view.project(place);
    if (visible && x > panel + 20 && y > 20 && page.hit(x, y)?.what === s) places.push({ x, y });
  }
  return places;
})()`;

/** Where a place of the map is in the picture; it has to be the surface that is seen there. */
async function onSurface(page, place, id) {
  const at = await page.value(`(() => {
    const { x, y } = page.view.project(${JSON.stringify(place)}.map((one, k) => one - page.map.origin[k]));
    return { x, y, id: page.hit(x, y)?.what.id };
  })()`);
  assert.equal(at.id, id, `${place} is to be seen`);
  return at;
}

const different = (a, b) => Math.max(...a.map((x, k) => Math.abs(x - b[k]))) > 25;
const colorAt = async (page, at) => (await page.colors([at]))[0];

async function lookAround(page) {
  assert.equal(await page.value('window.injected'), undefined, 'a map\'s name is text');
  assert.match(await page.text('#summary'), /\d+ surfaces/);
  assert.equal(await page.value('document.getElementById("layer-pending").checked'), false);
  const [at, far] = [await onSurface(page, [5, 2.4, 0], 2), await onSurface(page, [1, 2.9, 0], 2)];
  await page.hover(at.x, at.y);
  assert.match(await page.text('#tip'), /surface 2 /);
  await page.press('#search-text');
  await page.type('2');
  await page.key('Enter');
  assert.equal(await page.text('#details-title'), 'Surface 2');
  await page.key('Escape');
  assert.equal(await page.visible('#details'), false);
  await page.press('#top');

  const drawn = await colorAt(page, at);
  await page.press('#layer-surfaces');
  assert.equal(await page.value(`page.hit(${at.x}, ${at.y})`), null, 'what is switched off is not picked');
  assert.ok(different(await colorAt(page, at), drawn), 'nor drawn');
  await page.press('#layer-surfaces');

  await page.press('#measure');
  await page.click(at.x, at.y);
  await page.click(far.x, far.y);
  const [, distance] = /^(\d+\.\d{3}) m: /.exec(await page.text('#measure-label'));
  assert.ok(Math.abs(distance - Math.hypot(4, 0.5)) < 0.05, `${distance} m are measured`);
}

/** The picked place, and what of it can be taken along. */
async function aPickedPlace(page) {
  const place = [5, 2.4, 0], at = await onSurface(page, place, 2);
  await page.click(at.x, at.y);
  assert.match(await page.text('#details-table'), /m²/);
  const text = await page.text('#place-text');
  assert.match(text, /^-?\d+\.\d{3} -?\d+\.\d{3} -?\d+\.\d{3}$/, 'as --at takes it');
  text.split(' ').forEach((x, k) => assert.ok(Math.abs(x - place[k]) < 0.02, `${text} is where it was clicked`));
  await page.press('#place-copy');
  await page.until('document.getElementById("place-copy").textContent === "Copied"');
  assert.equal(await page.value('navigator.clipboard.readText()'), text);
  assert.equal(await page.visible('#lineage-table'), false, 'lineage is folded');
  await page.press('#lineage summary');
  assert.match(await page.text('#lineage-table'), /appeared.*changed.*took in1 /);
}

/** Contact regions of two feet, as make_pages knows them. */
async function feet(page) {
  const middle = await onSurface(page, [5, 2.4, 0], 2), nearWall = await onSurface(page, [3, 0.12, 0], 2);
  const bare = await page.colors([middle, nearWall]);
  await page.press('#layer-regions');
  assert.match(await page.text('#legend'), /the middle of a foot may be here: large/);
  // Four boxes 0.18 m above each other, 0.3 m deep and 1.2 m wide (room_snapshot.hpp).
  assert.match(await page.text('#legend'), /stair \d+: 4 risers of 18\.0 cm, treads of 30\.0 cm, 1\.\d+ m wide/);
  const large = await page.colors([middle, nearWall]);
  assert.deepEqual([0, 1].map((i) => different(bare[i], large[i])), [true, false], 'the large foot keeps off the wall');
  await page.choose('select[aria-label^="Contact regions"]', 'small');
  assert.ok(different(bare[1], await colorAt(page, nearWall)), 'the small foot may go to it');
  await page.click(middle.x, middle.y);
  assert.match(await page.text('#details-table'), /its middle may be on 22\.3\d+ m² \(small\)/);
  await page.value('page.search("8")');
  assert.match(await page.text('#details-table'), /nowhere: slope/);
  await page.key('Escape');
  await page.press('#layer-regions');
  await page.press('#top');
}

/** Slopes say what is walkable; a ceiling can be hidden. */
async function whatIsShown(page) {
  await page.choose('select[aria-label^="Surfaces"]', 'slope');
  assert.match(await page.text('#legend'), /30°0°60°90°slope to 30°: walkable/);
  await page.choose('#range-surfaces', '20');
  assert.match(await page.text('#legend'), /slope to 20°: walkable.*steeper than 20°/);
  const at = await onSurface(page, [5, 2.4, 0], 2), green = await colorAt(page, at);
  await page.press('#backs');
  const there = () => page.value(`page.hit(${at.x}, ${at.y})?.what.id ?? null`);
  assert.equal(await there(), 5, 'the ceiling is over it');
  assert.ok(different(await colorAt(page, at), green));
  await page.choose('#clip-to', '2');
  assert.equal(await there(), 2);
  assert.ok(!different(await colorAt(page, at), green), 'what is above 2 m is not drawn');
  await page.choose('#clip-from', '0.5');
  assert.equal(await there(), null, 'nor what is below 0.5 m');
  assert.ok(different(await colorAt(page, at), green));
}

async function aVoxel(page) {
  await page.press('#layer-voxels');
  const at = await page.value('page.view.project([1.1, 0.6, 1.2].map((x, k) => x - page.map.origin[k]))');
  assert.equal(await page.value(`page.hit(${at.x}, ${at.y}).kind`), 'voxel');
  await page.click(at.x, at.y);
  assert.match(await page.text('#details-table'), /centre1\.\d+ {2}0\.\d+ {2}1\.190 m.*none: pending/);
}

async function aRoom(browser) {
  for (const test of [lookAround, aPickedPlace, feet, whatIsShown, aVoxel]) {
    const page = await browser.open(join(folder, 'room.html'));
    await page.press('#top');
    await test(page);
    assert.deepEqual([page.errors, page.fetched], [[], []], 'nothing is fetched');
  }
}

/** A map that lies on its side: -y is up, and it says z. The floor is surface 2, the ceiling 5. */
async function aLyingMap(browser) {
  const page = await browser.open(join(folder, 'lying.html'));
  const slopeOf = async (id) => {
    await page.value(`page.search('${id}')`);
    return Number(/slope([\d.]+)°/.exec(await page.text('#details-table'))[1]);
  };
  const heightInView = (id) => page.value(`page.stage.upright(page.map.surface(${id}).origin)[2]`);
  assert.equal(await slopeOf(2), 90, 'as the map has it, the floor is a wall');
  assert.match(await page.text('#layers'), /Surfaces suggest that up is -y/);
  assert.equal(await page.visible('#notice'), false);
  await page.press('#up-suggested');
  assert.deepEqual([await slopeOf(2), await slopeOf(5)], [0, 180]);
  assert.ok(Math.abs(await heightInView(5) - await heightInView(2) - 2.5) < 1e-6, 'the ceiling is over the floor');
  assert.doesNotMatch(await page.text('#layers'), /suggest/);
  assert.match(await page.text('#notice'), /Contact regions are for up = z; --up -y/);
  await page.choose('select[aria-label^="Surfaces"]', 'slope');
  await page.key('Escape');
  await page.press('#top');
  const [floor] = await page.value(seen(2)), [r, g] = await colorAt(page, floor);
  assert.ok(g > r + 40, `a level floor is green: ${[r, g]}`);
  // Its ceiling is 2.5 m along -y.
  await page.choose('#clip-to', '2');
  assert.equal(await page.value('page.view.renderer.clippingPlanes[0].constant - page.map.origin[1]'), 2, 'heights are along it');
  await page.choose('#up', 'own');
  assert.equal(await slopeOf(2), 90);
  assert.equal(await page.value('page.stage.settings.clip.to'), null, 'that height meant another one');
  assert.deepEqual(page.errors, []);
}

/** On a telephone the sheet lies over the lower part: what is picked there moves into what is left. */
async function onATelephone(browser) {
  const page = await browser.open(join(folder, 'room.html'), { width: 390, height: 800, touch: true });
  await page.value('page.view.orbit(0, 30, 0.6)');
  await page.settled();
  const lowest = await page.value(`(() => {
    let found = null;
    for (let y = 790; !found && y > 400; y -= 10)
      for (let x = 60; !found && x < 330; x += 30) if (page.hit(x, y)?.kind === 'surface') found = { x, y };
    return found;
  })()`);
  assert.ok(lowest.y > 480, 'where the sheet will lie');
  await page.tap(lowest.x, lowest.y);
  const { y, sheet, panel } = await page.value(`({ y: page.view.project(page.picked.place).y,
    sheet: document.getElementById('details').getBoundingClientRect().top,
    panel: document.getElementById('panel').getBoundingClientRect().bottom })`);
  assert.ok(sheet >= 400, `half of the page stays free: ${sheet}`);
  assert.ok(y > panel && y < sheet, `the picked place is to be seen: ${panel} < ${y} < ${sheet}`);
  assert.deepEqual(page.errors, []);
}

/** Many voxels: drawn coarser while the camera moves, whole at rest; a page that is limited says what it left out. */
async function manyVoxels(browser) {
  const page = await browser.open(join(folder, 'hills.html'));
  const count = await page.value('page.map.voxels.count');
  await page.press('#layer-voxels');
  const drawnAfter = (frameMs) => page.value(`(() => {
    for (let i = 0; i < 60; ++i) page.stage.drawAtLength(true, ${frameMs});
    return page.stage.objects.get('voxels').geometry.drawRange.count;
  })()`);
  assert.ok(await drawnAfter(500) < 10000, 'what takes too long is drawn coarser');
  assert.equal(await drawnAfter(5), count, 'what is quick is drawn whole');
  await page.value('page.view.orbit(2, 0)');
  await page.settled();
  assert.equal(await page.value('page.stage.objects.get("voxels").geometry.drawRange.count'), count, 'whole at rest');
  const small = await browser.open(join(folder, 'small.html'));
  assert.match(await small.text('#notice'), new RegExp(`Voxels are drawn merged.* ${count / 1000}\\s000 voxels`));
  assert.ok(await small.value('page.map.voxels.count') < count);
  assert.equal(await page.visible('#notice'), false);
  assert.deepEqual([...page.errors, ...small.errors], []);
}

async function nothing(browser) {
  const page = await browser.open(join(folder, 'empty.html'));
  assert.equal(await page.visible('#message'), false);
  assert.deepEqual(page.errors, []);
}

await runInBrowser([aRoom, aLyingMap, onATelephone, manyVoxels, nothing,
  ...(command ? [followsTheMap, asks] : [])]);
