// live_test.mjs COMMAND: the page of `octosurf map --serve`, in a real browser, while the map grows.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { Browser, chromium, skipped } from './browser.mjs';

const command = process.argv[2];
const program = chromium();
if (!program) {
  console.log('skipped: no Chromium');
  process.exit(skipped);
}

/** A run that maps a stair so slowly that it does not end before it is told to; resolves with its address once it serves. */
async function mapping(folder) {
  const scans = join(folder, 'scans');
  execFileSync(command, ['simulate', 'stairs', '-o', scans, '--frames', '400', '--noise-scale', '0']);
  const run = spawn(command, ['map', scans, '-o', join(folder, 'map'), '--realtime', '--rate', '2', '--serve', '0']);
  let said = '';
  const address = await new Promise((resolve, reject) => {
    run.once('exit', () => reject(new Error(`it does not serve: ${said}`)));
    run.stdout.on('data', (text) => {
      said += text;
      const found = /serving (http:\S+)/.exec(said);
      if (found) resolve(found[1]);
    });
  });
  return { run, address };
}

const folder = mkdtempSync(join(tmpdir(), 'octosurf-live-'));
const browser = new Browser(program);
try {
  const { run, address } = await mapping(folder);
  const answer = await fetch(address);
  if (/built without the page/.test(await answer.text())) {
    console.log('skipped: built without the page');
    process.exitCode = skipped;
  } else {
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
    assert.deepEqual(page.errors, []);
    assert.ok(page.fetched.every((url) => url.startsWith(address)), page.fetched.join(' '));
    run.kill();
    await page.until('!document.getElementById("message").hidden', 60);
    assert.match(await page.text('#message'), /no longer served/);
    console.log('follows the map: well');
  }
  run.kill();
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
