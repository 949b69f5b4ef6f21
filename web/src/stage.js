// The map that is shown, and its layers' objects: made when first shown, thrown away when they are outdated.
import * as THREE from 'three';
import { limitsIn, noClip } from './clip.js';
import { onSurface } from './data.js';
import { dispose } from './highlight.js';
import { layers } from './layers/index.js';
import { orient } from './up.js';

const samplesPerArea = 40;  // a m²
// A frame's time: less is drawn above the one, more below the other; and how much, in points, first and at least. A
// graphics card draws a million voxels in that time, a processor in its place ten thousand.
const smoothMs = 33, quickMs = 24, firstPoints = 8000, leastPoints = 2000, mostPoints = 1e9;
const ofVoxels = new Set(['voxels', 'pending']);

/** Places on the map, as many as it has area there; without surfaces, voxels. */
function samplesOf({ surfaces, voxels }) {
  const places = [];
  for (const surface of surfaces) {
    const count = Math.min(surface.u.length, Math.max(4, Math.round(samplesPerArea * surface.area_m2)));
    for (let i = 0; i < count; ++i) {
      const vertex = Math.floor(i * surface.u.length / count);
      places.push(onSurface(surface, surface.u[vertex], surface.v[vertex]));
    }
  }
  if (places.length === 0 && voxels) {
    for (let i = 0; i < voxels.count; i += Math.ceil(voxels.count / 20000))
      places.push([voxels.x[i], voxels.y[i], voxels.z[i]].map((cell, k) => voxels.low[k] + cell * voxels.size));
  }
  if (places.length === 0) places.push([-1, -1, -1], [1, 1, 1]);
  return places;
}

/** Upright, without the strays: 1 to 99 % of the map. */
function extentOf(map, rotation) {
  const upright = samplesOf(map).map((place) => new THREE.Vector3(...place).applyQuaternion(rotation));
  const box = new THREE.Box3();
  for (const axis of ['x', 'y', 'z']) {
    const sorted = upright.map((place) => place[axis]).sort((a, b) => a - b);
    box.min[axis] = sorted[Math.floor(0.01 * (sorted.length - 1))];
    box.max[axis] = sorted[Math.ceil(0.99 * (sorted.length - 1))];
  }
  return box;
}

/** Of the directions to look from, obliquely from above, the one that the most area faces. */
function bestSide(map, rotation) {
  const normals = map.surfaces.map(({ normal, area_m2: area }) =>
    ({ area, normal: new THREE.Vector3(...normal).applyQuaternion(rotation) }));
  let best = null, most = -1;
  for (let turn = 0; turn < 16; ++turn) {
    const angle = (turn + 0.5) * Math.PI / 8;  // not along the axes, which most walls are
    const from = new THREE.Vector3(Math.cos(angle), Math.sin(angle), 0.8).normalize();
    const seen = normals.reduce((sum, one) => sum + one.area * Math.max(0, one.normal.dot(from)), 0);
    if (seen > most) [best, most] = [from.toArray(), seen];
  }
  return best;
}

export class Stage {
  /** @param {import('./view.js').View} view @param {import('./theme.js').Theme} theme */
  constructor(view, theme) {
    Object.assign(this, { view, theme, objects: new Map(), allowed: firstPoints, whole: true });
    /** What the reader has chosen. */
    this.settings = {
      on: Object.fromEntries(layers.map(({ id, on }) => [id, on])), choice: {},
      cut: true,  // surfaces seen from behind are left out
      up: null,   // in the map frame; null: the map's own
      clip: noClip(), walkableDeg: 30,
    };
    view.beforePicture.push((moving, frameMs) => this.drawAtLength(moving, frameMs));
  }

  /** At rest everything is drawn whole; while the camera moves, as coarse as it takes for some 30 pictures a second. */
  drawAtLength(moving, frameMs) {
    if (moving && frameMs > smoothMs) this.allowed *= Math.max(0.4, smoothMs / frameMs);
    if (moving && frameMs > 0 && frameMs < quickMs && !this.whole) this.allowed *= 1.4;
    this.allowed = Math.min(mostPoints, Math.max(leastPoints, this.allowed));
    let left = moving ? this.allowed : Infinity;
    this.whole = true;
    for (const object of this.objects.values()) {
      if (!object.visible || !object.userData.draw) continue;
      const { cost, whole } = object.userData.draw(left);
      left = Math.max(1, left - cost);
      this.whole &&= whole;
    }
  }

  has(layer) { return layer.has?.(this.map, this) ?? true; }
  shows(id) { return this.settings.on[id] && this.has(layers.find((one) => one.id === id)); }

  show(map) {
    this.map = map;
    this.takeExtent();
    this.renew();
  }

  /** @param {number[]?} up null: the map's own. Heights are others then. */
  turn(up) {
    Object.assign(this.settings, { up, clip: noClip() });
    this.takeExtent();
    this.renew();
  }

  /** @param {import('./clip.js').Clip} clip */
  clipHeights(clip) {
    this.settings.clip = clip;
    this.view.clip(...limitsIn(this.map, clip));
  }

  takeExtent() {
    const { map, view: { root } } = this;
    orient(map, this.settings.up ?? map.ownUp);
    root.quaternion.set(...map.rotation);
    root.updateMatrixWorld();
    this.extent = extentOf(map, root.quaternion);
    this.side = bestSide(map, root.quaternion);
    this.clipHeights(this.settings.clip);
  }

  /** From root coordinates. */
  upright(place) { return this.view.root.localToWorld(new THREE.Vector3(...place)).toArray(); }

  /** All but the voxels of the map that is shown is another. */
  mapChanged() {
    this.takeExtent();
    for (const { id } of layers) if (!ofVoxels.has(id)) this.renew(id);
  }

  voxelsChanged() {
    for (const id of ofVoxels) this.renew(id);
  }

  /** Makes the shown layers anew: all, or one. */
  renew(id) {
    for (const [one, object] of [...this.objects]) {
      if (id !== undefined && one !== id) continue;
      dispose(object);
      this.objects.delete(one);
    }
    this.refresh();
  }

  refresh() {
    if (!this.map) return;
    for (const layer of layers) {
      const shown = this.shows(layer.id);
      if (shown && !this.objects.has(layer.id)) {
        const object = layer.create(this.map, this);
        this.objects.set(layer.id, object);
        this.view.root.add(object);
      }
      const object = this.objects.get(layer.id);
      // Pending points are in the middle of their voxels, where nobody sees them.
      if (object) object.visible = shown && !(layer.id === 'pending' && this.shows('voxels'));
    }
    this.view.redraw();
  }

  switch(id, on = !this.settings.on[id]) {
    this.settings.on[id] = on;
    this.refresh();
  }

  choose(id, choice) {
    this.settings.choice[id] = choice;
    this.renew(id);
  }
}
