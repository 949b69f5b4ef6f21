// live_test.mjs COMMAND MAP: the pages of `octosurf map --serve` while the map grows, and of `octosurf serve`, in a real
// browser.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { Browser, chromium, skipped } from './browser.mjs';

const [command, map] = process.argv.slice(2);
const program = chromium();
if (!program) {
  console.log('skipped: no Chromium');
  process.exit(skipped);
}

/** Runs the command; resolves with its address once it serves. */
async function serving(...words) {
  const run = spawn(command, words);
  let said = '';
  const address = await new Promise((resolve, reject) => {
    run.once('exit', () => reject(new Error(`it does not serve: ${said}`)));
    run.stderr.on('data', (text) => { said += text; });
    run.stdout.on('data', (text) => {
      said += text;
      const found = /serving (http:\S+)/.exec(said);
      if (found) resolve(found[1]);
    });
  });
  return { run, address };
}

/** A run that maps a stair so slowly that it does not end before it is told to. */
const mapping = (folder, name, port) =>
  serving('map', join(folder, 'scans'), '-o', join(folder, name), '--realtime', '--rate', '2', '--serve', port);

/** Where each scan was made. */
const posesOf = (scans) => readdirSync(scans).filter((name) => name.endsWith('.pose.txt')).map((name) => {
  const T = readFileSync(join(scans, name), 'utf8').trim().split(/\s+/).map(Number);
  return [T[3], T[7], T[11]];
});

async function ended(run) {
  if (run.exitCode !== null) return;
  const end = new Promise((resolve) => { run.once('exit', resolve); });
  run.kill();
  await end;
}

async function followsTheMap(browser, folder) {
  execFileSync(`${command}-lab`, ['simulate', 'stairs', '-o', join(folder, 'scans'), '--frames', '400', '--noise-scale', '0']);
  const { run, address } = await mapping(folder, 'first', '0');
  let again;
  try {
    const page = await browser.open(address);
    await page.ready();
    await page.until('page.map.surfaces.length > 0');
    const id = await page.value('page.map.surfaces[0].id');
    await page.press('#search-text');
    await page.type(String(id));
    await page.key('Enter');
    for (let i = 0; i < 3; ++i) {
      const before = await page.value('page.map.revision');
      await page.until(`page.map.revision > ${before}`, 60);
    }
    assert.equal(await page.text('#details-title'), `Surface ${id}`, 'what was picked stays picked');
    assert.equal(await page.value('page.following.told.whole'), false, 'it is told what changed, not the map');
    const whole = await (await fetch(`${address}api/surfaces`)).json();
    await page.until(`page.map.revision >= ${whole.revision}`, 60);
    const changed = await (await fetch(`${address}api/changes?since=${whole.revision}`)).json();
    await page.until(`page.map.revision >= ${changed.revision}`, 60);
    const drawn = await page.value('page.map.surfaces.map((s) => [s.id, s.revision])');
    const meanwhile = new Set([...changed.appeared, ...changed.changed, ...changed.gone, ...changed.merged.map((one) => one.id)]);
    for (const one of whole.surfaces.filter((s) => !meanwhile.has(s.id)))
      assert.ok(drawn.some(([i, revision]) => i === one.id && revision >= one.revision), `the page knows surface ${one.id}`);
    await page.until('document.getElementById("layer-pending") !== null', 60);
    await page.press('#layer-pending');
    await page.until('page.following.voxelsRevision > 1', 60);

    // The simulated camera's pose is that of one of its scans.
    const poses = posesOf(join(folder, 'scans'));
    const { origin, kind, places } = await page.until(`(page.map.sensor?.track.length > 1 ? { kind: page.map.sensor.kind,
      origin: page.map.toMap(page.map.sensor.origin), places: page.map.sensor.track.map(page.map.toMap) } : null)`, 60);
    const near = (place) => poses.some((pose) => Math.hypot(...pose.map((x, k) => x - place[k])) < 0.002);
    assert.equal(kind, 'depth_camera');
    assert.ok([origin, ...places].every(near), `the sensor has been where the scans were: ${places}`);
    assert.ok(await page.value('page.stage.objects.get("sensor").visible'));
    assert.match(await page.text('#legend'), /the sensor, at its last scan/);

    await page.press('#foot-show');
    await page.until('page.map.feet.length === 1', 60);
    assert.match(await page.text('#legend'), /asked at revision \d+: 0.22x0.11 m/);
    assert.ok(await page.value('page.stage.objects.get("regions").visible'));
    assert.deepEqual(page.errors, []);
    const known = ['live?', 'api/voxels?', 'api/regions/all?'].map((path) => address + path);
    assert.ok(page.fetched.every((url) => known.some((start) => url.startsWith(start))), page.fetched.join(' '));

    await ended(run);
    await page.until('!document.getElementById("message").hidden', 60);
    assert.match(await page.text('#message'), /no longer served/);
    again = (await mapping(folder, 'second', new URL(address).port)).run;
    await page.until('document.getElementById("message").hidden && page.following.told.messages > 0', 60);
    await page.until('page.map.surfaces.length > 0 && page.map.revision < 100', 60);
    await page.session.send('Page.close');
  } finally {
    await ended(run);
    if (again) await ended(again);
  }
}

/** The page of a finished map asks for regions and plans. */
async function asks(browser) {
  const { run, address } = await serving('serve', map);
  try {
    const page = await browser.open(address);
    await page.ready();
    const feet = await page.value('page.map.feet.length');
    await page.value('(document.querySelector("#foot-form [name=foot]").value = "big")');
    await page.press('#foot-show');
    await page.until('/foot/.test(document.getElementById("asking-answer").textContent)');
    await page.value('(document.querySelector("#foot-form [name=foot]").value = "0.05")');
    await page.press('#foot-show');
    await page.until(`page.map.feet.length === ${feet + 1}`, 60);
    assert.ok(await page.value('page.map.feet[0].regions.some((one) => one.polygons.length > 0)'));

    // The README's: from the floor of the office to the landing of its stair.
    await page.press('#top');
    await page.press('#plan-button');
    for (const place of [[-4.6, -0.6, 0.6], [-6.6, -2.7, 1.5]]) {
      const at = await page.value(`page.view.project(${JSON.stringify(place)}.map((x, k) => x - page.map.origin[k]))`);
      await page.click(at.x, at.y);
    }
    await page.until('page.map.plans.length === 1', 120);
    assert.match(await page.text('#asking-answer'), /^\d+ steps$/);
    assert.ok(await page.value('page.stage.objects.get("plans").visible'));
    assert.deepEqual(page.errors.filter((text) => !/400/.test(text)), [], 'but for the foot that is none');
  } finally {
    await ended(run);
  }
}

const withoutPage = await (async () => {
  const { run, address } = await serving('serve', map);
  try {
    return /built without the page/.test(await (await fetch(address)).text());
  } finally {
    await ended(run);
  }
})();
if (withoutPage) {
  console.log('skipped: built without the page');
  process.exit(skipped);
}
const folder = mkdtempSync(join(tmpdir(), 'octosurf-live-'));
const browser = new Browser(program);
try {
  for (const test of [followsTheMap, asks]) {
    await test(browser, folder);
    console.log(`${test.name}: well`);
  }
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
