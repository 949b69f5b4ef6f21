// page_test.mjs PAGES [COMMAND]: what a person does with the pages of make_pages, and with one that the command
// serves, in a real browser.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { existsSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { runInBrowser, skip } from './browser.mjs';

const [folder, command] = process.argv.slice(2);
if (!existsSync(folder)) skip('built without the page, so that there are none to look at');

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
  assert.equal(await page.visible('#undrawn'), false);
  assert.match(await page.text('#summary'), /\d+ surfaces/);
  assert.equal(await page.value('document.getElementById("layer-voxels").checked'), false);
  const [at, far] = [await onSurface(page, [5, 2.4, 0], 2), await onSurface(page, [1, 2.9, 0], 2)];
  await page.hover(at.x, at.y);
  assert.match(await page.text('#tip'), /surface 2 /);

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

async function aPickedPlace(page) {
  const place = [5, 2.4, 0], at = await onSurface(page, place, 2);
  await page.click(at.x, at.y);
  assert.equal(await page.text('#details-title'), 'Surface 2');
  assert.match(await page.text('#details-table'), /m²/);
  const text = await page.text('#place');
  assert.match(text, /^-?\d+\.\d{3} -?\d+\.\d{3} -?\d+\.\d{3}$/, 'as --at takes it');
  text.split(' ').forEach((x, k) => assert.ok(Math.abs(x - place[k]) < 0.02, `${text} is where it was clicked`));
  await page.key('Escape');
  assert.equal(await page.visible('#details'), false);
}

/** Four boxes 0.18 m above each other, 0.3 m deep and 1.2 m wide (room_snapshot.hpp). */
async function stairs(page) {
  assert.match(await page.text('#legend'), /stair \d+: 4 risers of 18\.0 cm, treads of 30\.0 cm, 1\.\d+ m wide/);
}

/** Slopes say what is walkable; what is seen from behind is not drawn, so that ceilings hide nothing. */
async function slopes(page) {
  const at = await onSurface(page, [5, 2.4, 0], 2);
  await page.choose('select[aria-label^="Surfaces"]', 'slope');
  assert.match(await page.text('#legend'), /slope 0°90°to 30°: walkable/);
  const [r, g] = await colorAt(page, at);
  assert.ok(g > r + 40, `a level floor is green: ${[r, g]}`);
}

/** The pillar of make_room(), which was seen from one side. */
async function aCylinder(page) {
  const place = '[5.088, 0.912, 1.25].map((x, k) => x - page.map.origin[k])';
  await page.value(`page.view.look([5.8, 0.2, 1.25].map((x, k) => x - page.map.origin[k]), ${place})`);
  await page.settled();
  const { x, y } = await page.value(`page.view.project(${place})`);
  await page.click(x, y);
  assert.match(await page.text('#details-title'), /^Cylinder c\d+$/);
  assert.match(await page.text('#details-table'), /radius\d+\.\d\d cm/);
  assert.match(await page.text('#legend'), /cylinder/);
}

async function aVoxel(page) {
  await page.press('#layer-voxels');
  const at = await page.value('page.view.project([1.1, 0.6, 1.2].map((x, k) => x - page.map.origin[k]))');
  assert.equal(await page.value(`page.hit(${at.x}, ${at.y}).kind`), 'voxel');
  await page.click(at.x, at.y);
  assert.match(await page.text('#details-table'), /centre1\.\d+ {2}0\.\d+ {2}1\.190 m.*pending/);
}

async function aRoom(browser) {
  for (const test of [lookAround, aPickedPlace, stairs, slopes, aCylinder, aVoxel]) {
    const page = await browser.open(join(folder, 'room.html'), { dark: test === slopes });
    await page.press('#top');
    await test(page);
    assert.deepEqual([page.errors, page.fetched], [[], []], 'nothing is fetched');
  }
}

/** A map that lies on its side: -y is up, and it says z. The floor is surface 2, the ceiling 5. */
async function aLyingMap(browser) {
  const page = await browser.open(join(folder, 'lying.html'));
  const slopeOf = async (id) => {
    await page.pick('surface', id);
    return Number(/slope([\d.]+)°/.exec(await page.text('#details-table'))[1]);
  };
  const heightInView = (id) => page.value(
    `page.view.root.localToWorld(page.view.eye.set(...page.map.surface(${id}).origin)).z`);
  assert.equal(await slopeOf(2), 90, 'as the map has it, the floor is a wall');
  assert.equal(await page.visible('#notice'), false);
  await page.choose('#up', '-y');
  assert.deepEqual([await slopeOf(2), await slopeOf(5)], [0, 180]);
  assert.ok(Math.abs(await heightInView(5) - await heightInView(2) - 2.5) < 1e-6, 'the ceiling is over the floor');
  await page.choose('#up', 'own');
  assert.equal(await slopeOf(2), 90);
  assert.deepEqual(page.errors, []);
}

/** On a telephone what was picked is said in a sheet over the lower part. */
async function onATelephone(browser) {
  const page = await browser.open(join(folder, 'room.html'), { width: 390, height: 800, touch: true });
  const at = await page.value('page.view.project(page.map.surface(2).origin.map((x, k) => x + [5, 2.4, 0][k]))');
  await page.tap(at.x, at.y);
  assert.ok(await page.visible('#details'));
  const sheet = await page.value('document.getElementById("details").getBoundingClientRect().top');
  assert.ok(sheet >= 400, `half of the page stays free: ${sheet}`);
  assert.deepEqual(page.errors, []);
}

/** The whole map fills most of what the panel leaves free, in any window, until the camera is moved. */
async function fitsTheWindow(browser) {
  const fits = async (page, [width, height]) => {
    const { x, y, left, top } = await page.value(`(() => {
      const seen = page.map.surfaces.flatMap(({ origin, axes: [a, b], u, v }) => Array.from(u, (_, i) =>
        page.view.project(origin.map((one, k) => one + a[k] * u[i] + b[k] * v[i]))));
      const { right, bottom } = document.getElementById('panel').getBoundingClientRect(), narrow = innerWidth <= 640;
      const beside = !narrow && document.getElementById('panel-body').checkVisibility();
      return { x: seen.map((at) => at.x), y: seen.map((at) => at.y), left: beside ? right : 0, top: narrow ? bottom : 0 };
    })()`);
    const spans = [[x, left, width], [y, top, height]].map(([at, from, to]) =>
      [Math.min(...at), Math.max(...at)].map((one) => (one - from) / (to - from)));
    const which = `${width} × ${height}: ${JSON.stringify(spans)}`;
    assert.ok(spans.every(([low, high]) => low >= 0 && high <= 1), `the whole map is in ${which}`);
    assert.ok(spans.every(([low, high]) => Math.abs(low + high - 1) < 0.05), `it is in the middle of ${which}`);
    assert.ok(Math.max(...spans.map(([low, high]) => high - low)) > 0.85, `it fills ${which}`);
  };
  const resize = async (page, [width, height]) => {
    await page.session.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: false });
    await page.until(`page.view.canvas.clientWidth === ${width}`);
    await page.settled();
  };
  const desk = [1280, 800], telephone = [390, 800], tablet = [640, 500], wide = [1920, 600];
  for (const [name, first, ...then] of [['room', desk, telephone, wide], ['lying', telephone, desk, tablet], ['hills', wide, telephone]]) {
    const page = await browser.open(join(folder, `${name}.html`), { width: first[0], height: first[1] });
    await fits(page, first);
    if (name === 'room') {  // what is small counts little, however many of it there are
      await page.value('page.map.surfaces.push(...Array(2000).fill({ ...page.map.surfaces.at(-1), area_m2: 1e-3 }))');
      await page.value('page.stage.mapChanged(), page.fit(), null');
      await fits(page, first);
    }
    for (const size of then) {
      await resize(page, size);
      await fits(page, size);
    }
    await page.drag([350, 450], [380, 470]);
    const eye = await page.value('page.view.eye.toArray()');
    await resize(page, first);
    assert.deepEqual(await page.value('page.view.eye.toArray()'), eye, 'a camera that was moved stays');
    assert.deepEqual(page.errors, []);
  }
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
  await page.drag([700, 400], [800, 450]);
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

/** In a browser that cannot draw it: the page says so, and its lists and numbers are there. */
async function withoutWebGL(browser) {
  const page = await browser.open(join(folder, 'room.html'), { width: 390, height: 800 });
  assert.ok(await page.visible('#undrawn'));
  assert.match(await page.text('#undrawn'), /WebGL is off or missing.*--png/s);
  assert.match(await page.text('#summary'), /\d+ surfaces/);
  await page.press('#fold');
  assert.equal(await page.visible('#fit'), false, 'no button is there that does nothing');
  await page.press('#layer-voxels');
  assert.match(await page.text('#legend'), /height .*stair \d+: /s);
}

/** Runs the command; calls `visit` with its address once it serves, then ends it. */
async function serving(words, visit) {
  const run = spawn(command, words);
  const gone = new Promise((resolve) => { run.once('exit', resolve); });
  try {
    let said = '';
    const address = await new Promise((resolve, reject) => {
      gone.then(() => reject(new Error(`it does not serve: ${said}`)));
      run.stderr.on('data', (text) => { said += text; });
      run.stdout.on('data', (text) => {
        said += text;
        const found = /serving (http:\S+)/.exec(said);
        if (found) resolve(found[1]);
      });
    });
    await visit(address);
  } finally {
    run.kill();
    await gone;
  }
}

/** A run that maps a stair so slowly that it does not end before it is told to. */
const mapping = (folder, name, port, visit) =>
  serving(['map', join(folder, 'scans'), '-o', join(folder, name), '--realtime', '--serve', port], visit);

/** The page of `octosurf map --serve` while the map grows. */
async function followsTheMap(browser, folder) {
  const scans = join(folder, 'scans');
  execFileSync(`${command}-lab`, ['simulate', 'stairs', '-o', scans, '--frames', '200', '--noise-scale', '0']);
  writeFileSync(join(scans, 'times.txt'), Array.from({ length: 200 }, (_, i) => `${i / 2}\n`).join(''));
  let page, port;
  await mapping(folder, 'first', '0', async (address) => {
    ({ port } = new URL(address));
    page = await browser.open(address);
    await page.until('page.map.surfaces.length > 0');
    const id = await page.value('page.map.surfaces[0].id');
    await page.pick('surface', id);
    await page.until(`page.map.revision > ${await page.value('page.map.revision')} + 2`, 60);
    assert.equal(await page.text('#details-title'), `Surface ${id}`, 'what was picked stays picked');
    assert.equal(await page.value('page.following.told.whole'), false, 'it is told what changed, not the map');
    const whole = (await (await fetch(`${address}api/changes`)).json()).now;
    await page.until(`page.map.revision >= ${whole.revision}`, 60);
    const drawn = await page.value('page.map.surfaces.map((s) => [s.id, s.revision])');
    const changed = await (await fetch(`${address}api/changes?since=${whole.revision}`)).json();
    const meanwhile = new Set([...changed.appeared, ...changed.changed, ...changed.gone, ...changed.merged.map((one) => one.id)]);
    for (const one of whole.surfaces.filter((s) => !meanwhile.has(s.id)))
      assert.ok(drawn.some(([i, revision]) => i === one.id && revision >= one.revision), `the page knows surface ${one.id}`);
    await page.until('document.getElementById("layer-voxels") !== null', 60);
    await page.press('#layer-voxels');
    await page.until('page.following.voxelsRevision > 1', 60);

    assert.deepEqual(page.errors, []);
    const known = ['api/changes?', 'api/voxels'].map((path) => address + path);
    assert.ok(page.fetched.every((url) => known.some((start) => url.startsWith(start))), page.fetched.join(' '));
  });
  await page.until('!document.getElementById("message").hidden', 60);
  assert.match(await page.text('#message'), /no longer served/);
  const before = await page.value('page.map.revision');
  await mapping(folder, 'second', port, async () => {
    await page.until('document.getElementById("message").hidden', 60);
    await page.until(`page.map.surfaces.length > 0 && page.map.revision < ${before}`, 60);
    await page.session.send('Page.close');
  });
}

await runInBrowser([aRoom, aLyingMap, onATelephone, fitsTheWindow, manyVoxels, nothing, ...(command ? [followsTheMap] : [])]);
await runInBrowser([withoutWebGL], ['--disable-3d-apis']);
