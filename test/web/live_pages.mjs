// The page of `octosurf map --serve` while the map grows.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';

const [command] = process.argv.slice(3);

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

export async function followsTheMap(browser, folder) {
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
    const whole = await (await fetch(`${address}api/surfaces`)).json();
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
