// page_test.mjs PAGES: what a person does with the pages of make_pages, in a real browser.
import assert from 'node:assert/strict';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
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
  // Four boxes 0.18 m above each other, 0.3 m deep and 1.2 m wide (room_snapshot.hpp).
  assert.match(await page.text('#legend'), /stair \d+: 4 risers of 18\.0 cm, treads of 30\.0 cm, 1\.\d+ m wide/);
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

async function threeMaps(browser) {
  const page = await browser.open(join(folder, 'three.html'), { dark: true });
  await page.ready();
  const ids = () => page.value('page.map.surfaces.map((s) => s.id)');
  const slideTo = (number) => page.value(`(() => {
    const slider = document.getElementById('time-slider');
    slider.value = '${number}';
    slider.dispatchEvent(new Event('input'));
  })()`).then(() => page.settled());
  assert.match(await page.text('#time-name'), /^wednesday \(3 of 3\)/);
  const tableTop = 20;
  assert.ok(!(await ids()).includes(tableTop));
  await page.press('#earlier');
  assert.match(await page.text('#time-name'), /^tuesday \(2 of 3\)/);
  const tuesday = await ids();

  await slideTo(0);
  assert.match(await page.text('#time-name'), /^monday \(1 of 3\)/);
  const monday = await ids();
  assert.ok(monday.includes(tableTop));
  const [newest] = tuesday.filter((id) => !monday.includes(id));
  await page.press('#top');
  const [top] = await page.value(seen(tableTop));
  await page.press('#later');
  const [red, green] = (await page.colors([top]))[0];
  assert.ok(red > green + 25, `what went is a shade of red: ${[red, green]}`);
  const [step] = await page.value(seen(newest));
  const [r, g, b] = (await page.colors([step]))[0];
  assert.ok(g > r + 40 && g > b + 40, `what appeared is green: ${[r, g, b]}`);
  await page.click(step.x, step.y);
  assert.match(await page.text('#details-table'), /since before.*appeared/);
  await slideTo(2);
  assert.equal(await page.visible('#details'), false);

  await page.press('#play');
  assert.match(await page.text('#time-name'), /\([12] of 3\)/, 'it plays from the beginning');
  await page.until('page.timeline.at === 2 && !page.timeline.playing');
  await page.key('[');
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

/** A choice of the panel, as its reader makes it. */
const choose = (page, selector, value) => page.value(`(() => {
  const field = document.querySelector(${JSON.stringify(selector)});
  field.value = '${value}';
  field.dispatchEvent(new Event(field.type === 'range' ? 'input' : 'change'));
})()`).then(() => page.settled());

/** A map that lies on its side: -y is up, and it says z. The floor is surface 2, the ceiling 5. */
async function aLyingMap(browser) {
  const page = await browser.open(join(folder, 'lying.html'));
  await page.ready();
  const slopeOf = async (id) => {
    await page.value(`page.search('${id}')`);
    return Number(/slope([\d.]+)°/.exec(await page.text('#details-table'))[1]);
  };
  const heightInView = (id) => page.value(`page.stage.upright(page.map.surface(${id}).origin)[2]`);
  assert.equal(await slopeOf(2), 90, 'as the map has it, the floor is a wall');
  assert.match(await page.text('#layers'), /Surfaces suggest that up is -y/);
  assert.equal(await page.visible('#notice'), false);
  await page.press('#up-suggested');
  assert.equal(await slopeOf(2), 0);
  assert.equal(await slopeOf(5), 180);
  assert.ok(Math.abs(await heightInView(5) - await heightInView(2) - 2.5) < 1e-6, 'the ceiling is over the floor');
  assert.doesNotMatch(await page.text('#layers'), /suggest/);
  assert.match(await page.text('#notice'), /regions and plans are for up = z; --up -y/);
  await choose(page, 'select[aria-label^="Surfaces"]', 'slope');
  await page.key('Escape');
  await page.press('#top');
  const [floor] = await page.value(seen(2));
  const [r, g] = (await page.colors([floor]))[0];
  assert.ok(g > r + 40, `a level floor is green: ${[r, g]}`);
  // Its ceiling is 2.5 m along -y.
  await choose(page, '#clip-to', '2');
  assert.deepEqual(await page.value('page.stage.shown.heights.map((x) => x + page.map.toMap([0, 0, 0])[1] * -1)'),
    [null, 2], 'heights are measured along it');  // JSON has no infinity
  await choose(page, '#up', 'own');
  assert.equal(await slopeOf(2), 90);
  assert.equal(await page.value('page.stage.settings.clip.to'), null, 'that height meant another one');
  assert.deepEqual(page.errors, []);
}

/** Free space is looked up in the stored slices, which lie across then. make_pages: free at y 0.5 … 2 m, z 1 m. */
async function freeSpaceTurned(browser) {
  const page = await browser.open(join(folder, 'room.html'));
  await page.ready();
  await choose(page, '#up', 'x');
  await page.press('#layer-slice');
  await choose(page, '#range-slice', '25');
  assert.match(await page.text('#layers'), /3\.51 m/, '2.5 m over the first voxel in that direction, at 1.01 m');
  const free = await page.value(`(() => {
    const { data, width } = page.stage.objects.get('slice').material.map.image, places = [];
    for (let i = 0; i < data.length / 4; ++i) if (data[4 * i] === 70) places.push([i % width, Math.floor(i / width)]);
    const range = (k) => Math.max(...places.map((one) => one[k])) - Math.min(...places.map((one) => one[k])) + 1;
    return { count: places.length, ranges: [range(0), range(1)].sort((a, b) => a - b) };
  })()`);
  // 75 voxels of 2 cm along y; along z a slice stands for 10 cm, which is 5 of them.
  assert.deepEqual(free, { count: 375, ranges: [5, 75] });
  assert.deepEqual(page.errors, []);
}

/** The picked place, and what of it can be taken along. */
async function aPickedPlace(browser) {
  const page = await browser.open(join(folder, 'room.html'));
  await page.ready();
  await page.press('#top');
  const place = [5, 2.4, 0], at = await onSurface(page, place, 2);
  await page.click(at.x, at.y);
  const text = await page.text('#place-text');
  assert.match(text, /^-?\d+\.\d{3} -?\d+\.\d{3} -?\d+\.\d{3}$/, 'as --at takes it');
  text.split(' ').forEach((x, k) => assert.ok(Math.abs(x - place[k]) < 0.02, `${text} is where it was clicked`));
  const [first, second] = await page.value(`['#place', '#details-table'].map((one) =>
    document.querySelector(one).getBoundingClientRect().top)`);
  assert.ok(first < second, 'it stands first');
  await page.press('#place-copy');
  await page.until('document.getElementById("place-copy").textContent === "Copied"');
  assert.equal(await page.value('navigator.clipboard.readText()'), text);
  assert.equal(await page.visible('#lineage-table'), false, 'lineage is folded');
  await page.press('#lineage summary');
  assert.match(await page.text('#lineage-table'), /appeared.*changed.*took in1 /);
  assert.ok(await page.visible('#lineage-table'));
  assert.deepEqual(page.errors, []);
}

/** Slopes say what is walkable; a ceiling can be hidden; pending points are not in the way. */
async function whatIsShown(browser) {
  const page = await browser.open(join(folder, 'room.html'));
  await page.ready();
  assert.equal(await page.value('document.getElementById("layer-pending").checked'), false);
  await choose(page, 'select[aria-label^="Surfaces"]', 'slope');
  assert.match(await page.text('#legend'), /30°0°60°90°slope to 30°: walkable/);
  await choose(page, '#range-surfaces', '20');
  assert.match(await page.text('#legend'), /slope to 20°: walkable.*steeper than 20°/);
  await page.press('#top');
  const at = await onSurface(page, [5, 2.4, 0], 2);
  const [green] = await page.colors([at]);
  await page.press('#backs');
  const there = () => page.value(`page.hit(${at.x}, ${at.y}).what.id`);
  assert.equal(await there(), 5, 'the ceiling is over it');
  assert.ok(different((await page.colors([at]))[0], green));
  await choose(page, '#clip-to', '2');
  assert.equal(await there(), 2);
  assert.ok(!different((await page.colors([at]))[0], green), 'what is above 2 m is not drawn');
  await choose(page, '#clip-from', '0.5');
  assert.equal(await page.value(`page.hit(${at.x}, ${at.y})`), null, 'nor what is below 0.5 m');
  assert.ok(different((await page.colors([at]))[0], green));
  assert.deepEqual(page.errors, []);
}

/** Files that the page lets one save, and a link to what is seen. */
async function taken(browser, out) {
  const page = await browser.open(join(folder, 'three.html'));
  await page.ready();
  await page.press('#save');
  const saved = join(out, 'wednesday.json'), picture = join(out, 'wednesday.png');
  await waitFor(() => existsSync(saved));
  const document = JSON.parse(readFileSync(saved, 'utf8'));
  assert.deepEqual([document.format, document.version], ['octosurf-surfaces', 1]);
  assert.deepEqual(document.surfaces.map(({ id }) => id), await page.value('page.map.surfaces.map((s) => s.id)'));
  const floor = document.surfaces.find(({ id }) => id === 2);
  assert.deepEqual(floor.plane, { normal: [0, 0, 1], offset: 0 });
  assert.deepEqual(floor.polygons[0].outer, [[0, 0, 0], [6, 0, 0], [6, 4, 0], [0, 4, 0]]);
  assert.deepEqual(floor.polygons[0].outer_edges, ['real', 'occluded', 'sensor_limit', 'frontier']);
  assert.equal(floor.polygons[0].holes.length, 1);
  assert.equal(document.cylinders.length, await page.value('page.map.cylinders.length'));
  await page.press('#picture');
  await waitFor(() => existsSync(picture));
  const png = readFileSync(picture);
  assert.equal(png.toString('latin1', 1, 4), 'PNG');
  assert.deepEqual([png.readUInt32BE(16), png.readUInt32BE(20)], [1280, 800]);

  await page.press('#earlier');
  await choose(page, '#up', '-x');
  await page.press('#layer-normals');
  await page.press('#layer-grid');
  await choose(page, 'select[aria-label^="Surfaces"]', 'slope');
  await choose(page, '#clip-from', '-5');
  await page.drag([700, 400], [800, 450]);
  await page.value('page.search("2")');
  await page.settled();
  await page.press('#link');
  await page.until('document.getElementById("link").textContent === "Copied"');
  const hash = await page.value('location.hash');
  assert.ok((await page.value('navigator.clipboard.readText()')).endsWith(hash));
  const state = `(() => {
    const { stage, view, picked, timeline } = page, { on, choice, up, clip } = stage.settings;
    return { on, choice, up, clip, at: timeline.at, picked: picked.what.id,
      place: document.getElementById('place-text').textContent,
      camera: [...view.camera.position.toArray(), ...view.controls.target.toArray()] };
  })()`;
  const again = await browser.open(join(folder, 'three.html'), { hash });
  await again.ready();
  const [{ camera, ...rest }, { camera: first, ...firstRest }] = [await again.value(state), await page.value(state)];
  assert.deepEqual(rest, firstRest, 'the link shows what it was made of');
  camera.forEach((x, k) => assert.ok(Math.abs(x - first[k]) < 1e-3, `from where it was made: ${camera}, ${first}`));
  const nonsense = await browser.open(join(folder, 'three.html'),
    { hash: '#eye=1,2&target=a,b,c&up=0,0,0&layers=none&from=x&picked=7777&map=99&color.surfaces=constructor' });
  await nonsense.ready();
  assert.equal(await nonsense.visible('#message'), false);
  assert.deepEqual([...page.errors, ...again.errors, ...nonsense.errors], []);
}

async function waitFor(done) {
  for (let tries = 0; !done(); ++tries) {
    if (tries > 1000) throw new Error(`not within 20 s: ${done}`);
    await new Promise((resolve) => { setTimeout(resolve, 20); });
  }
}

/** On a telephone the sheet lies over the lower part: what is picked there moves into what is left. */
async function onATelephone(browser) {
  const page = await browser.open(join(folder, 'room.html'), { width: 390, height: 800, touch: true });
  await page.ready();
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

const browser = new Browser(program), out = mkdtempSync(join(tmpdir(), 'octosurf-page-output-'));
try {
  await browser.allowOutput(out);
  for (const test of [aRoom, feetAndPlans, threeMaps, aLyingMap, freeSpaceTurned, aPickedPlace, whatIsShown, taken, onATelephone,
    touched, large, nothing]) {
    await test(browser, out);
    console.log(`${test.name}: well`);
  }
} finally {
  await browser.close();
  rmSync(out, { recursive: true, force: true });
}
