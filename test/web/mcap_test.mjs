// mcap_test.mjs COMMAND: a file of `export --to x.mcap`, read with MCAP's own library and decoded by
// the descriptions that they carry.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { skip } from './browser.mjs';

const command = process.argv[2];
const require = createRequire(new URL('../../web/package.json', import.meta.url));
let core, support;
try {
  core = require('@mcap/core');
  support = require('@mcap/support');
} catch {
  skip('MCAP\'s library is missing (npm ci in web/)');
}
const decompressHandlers = await support.loadDecompressHandlers();

/** Read from its begin to its end, without the index; check sums are checked. @returns {number} messages */
function followsTheSpecification(bytes) {
  const reader = new core.McapStreamReader({ decompressHandlers, validateCrcs: true }), counts = new Map();
  reader.append(bytes);
  let statistics = null;
  for (let record; (record = reader.nextRecord());) {
    if (record.type === 'Message') {
      const known = counts.get(record.channelId) ?? 0n;
      assert.equal(BigInt(record.sequence), known);
      counts.set(record.channelId, known + 1n);
    } else if (record.type === 'Statistics') statistics = record;
  }
  assert.ok(reader.done());
  const sum = [...counts.values()].reduce((a, b) => a + b);
  assert.equal(statistics.messageCount, sum);
  for (const [channel, count] of counts) assert.equal(statistics.channelMessageCounts.get(channel), count);
  return Number(sum);
}

/** Messages as viewers get them, by the index and in the order of time: [topic, message]. */
async function messages(bytes) {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const reader = await core.McapIndexedReader.Initialize({ readable, decompressHandlers });
  const types = new Map();
  for (const [id, channel] of reader.channelsById) {
    const schema = reader.schemasById.get(channel.schemaId);
    assert.equal(schema.encoding, 'protobuf');
    types.set(id, support.protobufFromBinaryDescriptor(schema.data).lookupType(schema.name));
  }
  const all = [];
  for await (const { channelId, logTime, data } of reader.readMessages({ validateCrcs: true })) {
    const type = types.get(channelId), message = type.toObject(type.decode(data), { defaults: true, longs: Number });
    const { seconds, nanos } = message.timestamp ?? message.entities[0].timestamp;
    assert.equal(BigInt(seconds) * 1000000000n + BigInt(nanos), logTime);
    all.push([reader.channelsById.get(channelId).topic, message, type.fullName]);
  }
  return all;
}

const of = (all, topic) => all.filter((one) => one[0] === topic).map((one) => one[1]);
const close = (a, b, by, what) => assert.ok(Math.abs(a - b) <= by, `${what}: ${a}, not ${b}`);

const areaOf = ({ points, indices }) => {
  let sum = 0;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = indices.slice(i, i + 3).map((k) => points[k]);
    const [u, v] = [b, c].map((p) => [p.x - a.x, p.y - a.y, p.z - a.z]);
    sum += Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
  }
  return sum;
};

function areTheSurfaces(entities, map) {
  assert.deepEqual([...entities.keys()].sort(),
    [...map.surfaces.map((s) => `surface_${s.id}`), ...map.cylinders.map((c) => `cylinder_${c.id}`)].sort());
  for (const surface of map.surfaces) {
    const { frame_id, metadata, triangles } = entities.get(`surface_${surface.id}`);
    assert.equal(frame_id, 'map');
    const known = Object.fromEntries(metadata.map(({ key, value }) => [key, Number(value)]));
    close(known.area_m2, surface.area_m2, 1e-5 * surface.area_m2 + 1e-9, 'area');
    assert.equal(known.inliers, surface.inliers);
    const { r, g, b, a } = triangles[0].color;
    [r, g, b].forEach((part, i) => close(part, surface.color[i], 1e-4, 'colour'));
    assert.equal(a, 1);
    // The outlines are simplified by at most half a voxel.
    let length = 0;
    for (const { outer, holes } of surface.polygons)
      for (const ring of [outer, ...holes])
        ring.forEach((p, i) => { length += Math.hypot(...p.map((x, k) => x - ring[(i + 1) % ring.length][k])); });
    close(areaOf(triangles[0]), surface.area_m2, length * map.resolution / 2, `area of surface ${surface.id}`);
    const { normal, offset } = surface.plane;
    for (const { x, y, z } of triangles[0].points)
      close(normal[0] * x + normal[1] * y + normal[2] * z, offset, 1e-6, 'a corner is on its plane');
  }
}

/** TUM lines: stamp tx ty tz qx qy qz qw. */
const posesIn = (file) => readFileSync(file, 'utf8').split('\n').filter((line) => /^[-\d]/.test(line))
  .map((line) => line.split(/\s+/).map(Number));

function areThePoses(transforms, poses) {
  assert.equal(transforms.length, poses.length);
  transforms.forEach(({ timestamp, parent_frame_id, child_frame_id, translation: t, rotation: q }, i) => {
    assert.deepEqual([parent_frame_id, child_frame_id], ['map', 'sensor']);
    const found = [timestamp.seconds + timestamp.nanos / 1e9, t.x, t.y, t.z, q.x, q.y, q.z, q.w];
    const sign = Math.sign(q.w * poses[i][7]);
    found.forEach((x, k) => close(x * (k > 3 ? sign : 1), poses[i][k], 1e-6, 'pose'));
  });
}

const folder = mkdtempSync(join(tmpdir(), 'octosurf_mcap_'));
try {
  const at = (name) => join(folder, name);
  const run = (...words) => execFileSync(command, words, { stdio: ['ignore', 'pipe', 'pipe'] });
  execFileSync(`${command}-lab`, ['simulate', 'stairs', '-o', at('scans'), '--frames', '12']);
  run('map', at('scans'), '-o', at('m'), '--resolution', '0.04', '--keep-scans', at('kept'),
    '--write-poses', at('poses.txt'));
  run('export', at('m'), '--as-mapped', '--to', at('map.json'));
  run('export', at('m'), '--to', at('map.mcap'));
  const map = JSON.parse(readFileSync(at('map.json'), 'utf8')), poses = posesIn(at('poses.txt'));
  assert.ok(map.surfaces.length > 5 && poses.length === 12, 'there is something to see');

  const bytes = readFileSync(at('map.mcap')), count = followsTheSpecification(bytes), all = await messages(bytes);
  assert.equal(all.length, count);
  areThePoses(of(all, '/tf'), poses);
  areTheSurfaces(new Map(of(all, '/surfaces')[0].entities.map((entity) => [entity.id, entity])), map);
  for (const [, , type] of all) assert.match(type, /^\.foxglove\./);
  assert.deepEqual(of(all, '/trajectory')[0].poses.map(({ position: p }) => [p.x, p.y, p.z]),
    of(all, '/tf').map(({ translation: t }) => [t.x, t.y, t.z]));
} finally {
  rmSync(folder, { recursive: true, force: true });
}
