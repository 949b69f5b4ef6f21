// The map that is shown, and its layers' objects: made when first shown, thrown away when they are outdated.
import * as THREE from 'three';
import { limitsIn, noClip } from './clip.js';
import { onSurface } from './data.js';
import { Effort } from './detail.js';
import { dispose } from './highlight.js';
import { lightIn } from './layers/mesh.js';
import { layers } from './layers/index.js';
import { orient } from './up.js';

const samplesPerArea = 40;  // a m²
const ofVoxels = new Set(['voxels', 'pending', 'slice']);

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
    this.view = view;
    this.objects = new Map();
    this.context = {
      view, eye: new THREE.Vector3(), light: new THREE.Vector3(), cut: { value: true }, before: null,
      extent: new THREE.Box3(), ink: () => theme.ink, gridColor: () => theme.grid,
      settings: {
        on: Object.fromEntries(layers.map(({ id, on }) => [id, on])), choice: {}, sliceHeight: null,
        up: null, clip: noClip(), walkableDeg: 30,
      },
    };
    this.effort = new Effort();
    let whole = true;
    view.beforePicture.push((moving, frameMs) => {
      this.context.eye.copy(view.eye);
      if (moving) this.effort.note(frameMs, whole);
      whole = this.effort.share(layers.map(({ id }) => this.objects.get(id))
        .filter((object) => object?.visible && object.userData.draw), moving);
    });
  }

  get settings() { return this.context.settings; }
  has(layer) { return layer.has?.(this.map, this.context) ?? true; }
  shows(id) { return this.settings.on[id] && this.has(layers.find((one) => one.id === id)); }

  /** @param {object} map @param {object?} before in time */
  show(map, before) {
    this.map = map;
    this.context.before = before;
    this.takeExtent();
    this.renew();
  }

  /** @param {number[]?} up null: the map's own. Heights are others then. */
  turn(up) {
    Object.assign(this.settings, { up, clip: noClip(), sliceHeight: null });
    this.takeExtent();
    this.renew();
  }

  /** @param {import('./clip.js').Clip} clip */
  clipHeights(clip) {
    this.settings.clip = clip;
    this.view.clip(...limitsIn(this.map, clip));
  }

  takeExtent() {
    const { map } = this;
    orient(map, this.settings.up ?? map.ownUp);
    this.context.light.copy(lightIn(map.rotation));
    this.view.root.quaternion.set(...map.rotation);
    this.view.root.updateMatrixWorld();
    this.context.extent.copy(extentOf(map, this.view.root.quaternion));
    this.side = bestSide(map, this.view.root.quaternion);
    this.clipHeights(this.settings.clip);
  }

  /** From root coordinates. */
  upright(place) { return this.view.root.localToWorld(new THREE.Vector3(...place)).toArray(); }

  /** All but the voxels of the map that is shown is another. */
  mapChanged() {
    this.takeExtent();
    for (const { id } of layers) if (!ofVoxels.has(id)) this.renew(id);
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
        const object = layer.create(this.map, this.context);
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

  get shown() {
    return {
      surfaces: this.shows('surfaces'), cylinders: this.shows('cylinders'), voxels: this.shows('voxels'),
      pending: this.shows('pending'), cut: this.context.cut.value, heights: limitsIn(this.map, this.settings.clip),
    };
  }
}
