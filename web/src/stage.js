// The map that is shown, and its layers' objects: made when first shown, thrown away when they are outdated.
import * as THREE from 'three';
import { onSurface } from './data.js';
import { dispose } from './highlight.js';
import { layers } from './layers/index.js';
import { orient } from './up.js';

const mostSamples = 20000, samplesPerArea = 40;  // in all; a m²
const around = 0.15;  // of the diagonal of what is no stray; as in src/io/exporters/picture.cpp
// A frame's time: less is drawn above the one, more below the other; and how much, in points, first and at least. A
// graphics card draws a million voxels in that time, a processor in its place ten thousand.
const smoothMs = 33, quickMs = 24, firstPoints = 8000, leastPoints = 2000, mostPoints = 1e9;

/** Vertices of the surfaces, so many of each, the same several times where it has fewer; without surfaces, voxels. */
function samplesOf({ surfaces, voxels }, countOf) {
  const places = [];
  for (const surface of surfaces) {
    const count = countOf(surface);
    for (let i = 0; i < count; ++i) {
      const vertex = Math.floor(i * surface.u.length / count);
      places.push(onSurface(surface, surface.u[vertex], surface.v[vertex]));
    }
  }
  if (places.length === 0 && voxels) {
    for (let i = 0; i < voxels.count; i += Math.ceil(voxels.count / mostSamples))
      places.push([voxels.x[i], voxels.y[i], voxels.z[i]].map((cell, k) => voxels.low[k] + cell * voxels.size));
  }
  if (places.length === 0) places.push([-1, -1, -1], [1, 1, 1]);
  return places;
}

/** The map's places, upright, without the strays: those far from 1 to 99 % of it. */
function placesOf(map, rotation) {
  const upright = (countOf) => samplesOf(map, countOf).map((place) => new THREE.Vector3(...place).applyQuaternion(rotation));
  const perArea = Math.min(samplesPerArea, mostSamples / map.surfaces.reduce((sum, one) => sum + one.area_m2, 0));
  const samples = upright((surface) => Math.max(4, Math.round(perArea * surface.area_m2))), box = new THREE.Box3();
  for (const axis of ['x', 'y', 'z']) {
    const sorted = samples.map((place) => place[axis]).sort((a, b) => a - b);
    box.min[axis] = sorted[Math.floor(0.01 * (sorted.length - 1))];
    box.max[axis] = sorted[Math.ceil(0.99 * (sorted.length - 1))];
  }
  box.expandByScalar(around * box.getSize(new THREE.Vector3()).length());
  return upright(({ u }) => u.length).filter((place) => box.containsPoint(place));
}

export class Stage {
  /** @param {import('./view.js').View} view */
  constructor(view, map) {
    Object.assign(this, { view, map, objects: new Map(), allowed: firstPoints, whole: true });
    /** What the reader has chosen. `up`: in the map frame; null: the map's own. */
    this.settings = { on: Object.fromEntries(layers.map(({ id, on }) => [id, on])), choice: {}, up: null };
    view.beforePicture.push((moving, frameMs) => this.drawAtLength(moving, frameMs));
    this.turn(null);
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

  has(layer) { return layer.has?.(this.map) ?? true; }
  shows(id) { return this.settings.on[id] && this.has(layers.find((one) => one.id === id)); }

  /** @param {number[]?} up null: the map's own */
  turn(up) {
    this.settings.up = up;
    this.takeExtent();
    this.renew();
  }

  takeExtent() {
    const { map, view: { root } } = this;
    orient(map, this.settings.up ?? map.ownUp);
    root.quaternion.set(...map.rotation);
    root.updateMatrixWorld();
    this.view.places = placesOf(map, root.quaternion);
  }

  /** All but the voxels of the map that is shown is another. */
  mapChanged() {
    this.takeExtent();
    for (const { id } of layers) if (id !== 'voxels') this.renew(id);
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
    for (const layer of layers) {
      const shown = this.shows(layer.id);
      if (shown && !this.objects.has(layer.id)) {
        const object = layer.create(this.map, this);
        this.objects.set(layer.id, object);
        this.view.root.add(object);
      }
      const object = this.objects.get(layer.id);
      if (object) object.visible = shown;
    }
    this.view.redraw();
  }

  switch(id) {
    this.settings.on[id] = !this.settings.on[id];
    this.refresh();
  }

  choose(id, choice) {
    this.settings.choice[id] = choice;
    this.renew(id);
  }
}
