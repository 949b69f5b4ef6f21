// The canvas: camera, controls, and a picture whenever something has changed.
//
// `scene` is upright (z is up), `root` in it holds what is in the map frame less the data's origin.
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';

THREE.ColorManagement.enabled = false;

const viewAngleDeg = 50;
const filled = 0.95;  // of the window by the map that just fits
const restMs = 180;  // without movement for so long, everything is drawn whole

export class View {
  /** @param {HTMLCanvasElement} canvas @param {function(): number[]} taken pixels at the left and above, by the panel */
  constructor(canvas, taken) {
    Object.assign(this, { canvas, taken });
    try {
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
      this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    } catch {
      canvas.hidden = true;  // the page says why in its place
    }
    this.scene = new THREE.Scene();
    this.root = new THREE.Group();
    this.scene.add(this.root);
    this.camera = new THREE.PerspectiveCamera(viewAngleDeg, 1, 0.02, 200);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.maxPolarAngle = Math.PI;
    this.controls.addEventListener('change', () => {
      this.from = undefined;
      this.moved();
    });
    /** Called before each picture: with whether the camera is moving, and the last frame's ms. */
    this.beforePicture = [];
    this.afterPicture = [];
    this.pixels = new THREE.Vector2(1, 1);
    this.pixel = new Uint8Array(4);
    this.frameMs = 0;
    this.moving = false;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.renderer.getDrawingBufferSize(this.pixels);
    this.camera.aspect = width / height;
    const [left, above] = this.taken();  // the camera's target is in the middle of the rest
    this.camera.setViewOffset(width, height, -left / 2, -above / 2, width, height);
    if (this.from) this.fit(this.from);
    this.redraw();
  }

  /** The camera has moved: draws what may be coarser at once, and the whole when it rests. */
  moved() {
    this.moving = true;
    clearTimeout(this.restTimer);
    this.restTimer = setTimeout(() => {
      this.moving = false;
      this.lastFrame = undefined;
      this.redraw();
    }, restMs);
    this.redraw();
  }

  redraw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((now) => {
      this.asked = false;
      this.draw(now);
    });
  }

  draw(now) {
    this.frameMs = this.moving && this.lastFrame !== undefined ? now - this.lastFrame : 0;
    this.lastFrame = this.moving ? now : undefined;
    if (!this.renderer) return;
    this.camera.updateMatrixWorld();
    this.root.updateMatrixWorld();
    for (const call of this.beforePicture) call(this.moving, this.frameMs);
    this.renderer.render(this.scene, this.camera);
    if (this.moving) this.wait();
    for (const call of this.afterPicture) call();
  }

  /** Until the picture is there. Else pictures would queue up, and come seconds late where drawing is slow. */
  wait() {
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, this.pixel);
  }

  /** Into root coordinates. */
  get eye() {
    return this.root.worldToLocal(this.camera.position.clone());
  }

  /** The ray through a place of the page, upright. */
  ray(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect(), caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2(2 * (clientX - box.left) / box.width - 1, 1 - 2 * (clientY - box.top) / box.height),
      this.camera);
    return caster.ray;
  }

  /** Where a place of root coordinates is in the page: x, y, and whether it is before the camera. */
  project(place) {
    const box = this.canvas.getBoundingClientRect();
    const at = this.root.localToWorld(new THREE.Vector3(...place)).project(this.camera);
    return {
      x: box.left + (at.x + 1) / 2 * box.width,
      y: box.top + (1 - at.y) / 2 * box.height,
      visible: at.z < 1,
    };
  }

  /** Both in upright coordinates. */
  look(eye, target) {
    this.camera.position.set(...eye);
    this.controls.target.set(...target);
    this.controls.update();
    this.moved();
  }

  /** So near that all of `places` (stage.js) just fits, also when the window changes, until the camera is moved. */
  fit(from) {
    const back = new THREE.Vector3(...from).normalize();
    const right = new THREE.Vector3(0, 0, 1).cross(back).normalize(), up = back.clone().cross(right);
    // The camera at c along an axis of the picture and d backward sees what is at a and b if |a - c| <= tangent (d - b).
    const nearest = (axis, tangent) => {
      let low = Infinity, high = -Infinity;
      for (const place of this.places) {
        const a = place.dot(axis), b = tangent * place.dot(back);
        [low, high] = [Math.min(low, a - b), Math.max(high, a + b)];
      }
      return { c: (low + high) / 2, d: (high - low) / 2 / tangent };
    };
    const { clientWidth: width, clientHeight: height } = this.canvas, [left, above] = this.taken();
    const tangent = filled * Math.tan(viewAngleDeg / 2 * Math.PI / 180) / Math.max(1, height);
    const depth = nearest(back, 0).c, free = [width - left, height - above].map((pixels) => tangent * Math.max(1, pixels));
    const needed = [right, up].map((axis, k) => nearest(axis, free[k]).d - depth), distance = Math.max(0.1, ...needed);
    // Where there is room on both sides, it is about the same.
    const [x, y] = [right, up].map((axis, k) => nearest(axis, free[k] * needed[k] / distance).c);
    this.camera.near = Math.max(0.005, distance / 1000);
    this.camera.far = 20 * Math.max(distance, 1);
    this.camera.updateProjectionMatrix();
    const target = right.multiplyScalar(x).addScaledVector(up, y).addScaledVector(back, depth);
    this.look(back.multiplyScalar(distance).add(target).toArray(), target.toArray());
    this.from = from;
  }
}
