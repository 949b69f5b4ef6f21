// How much is drawn while the camera moves. At rest everything is drawn whole; while it moves, as coarse as it takes
// for some 30 pictures a second: a graphics card draws a million voxels whole in that time, a processor in its place
// ten thousand.

const smoothMs = 33, quickMs = 24;  // a frame's time: less is wanted above the one, more below the other
const least = 2000, first = 8000, most = 1e9;

/** What a frame may cost, in points drawn, learnt from what frames took. */
export class Effort {
  allowed = first;

  /** @param {number} frameMs from picture to picture @param {boolean} whole nothing was left out */
  note(frameMs, whole) {
    if (frameMs > smoothMs) this.allowed *= Math.max(0.4, smoothMs / frameMs);
    else if (frameMs > 0 && frameMs < quickMs && !whole) this.allowed *= 1.4;
    this.allowed = Math.min(most, Math.max(least, this.allowed));
  }

  /**
   * Has each object drawn at its share: what one does not need is left to those after it.
   * @param {THREE.Object3D[]} objects whose userData.draw(allowed) returns {cost, whole}
   * @returns {boolean} whether all are whole
   */
  share(objects, moving) {
    let left = moving ? this.allowed : Infinity, whole = true;
    objects.forEach((object, i) => {
      const drawn = object.userData.draw(left / (objects.length - i));
      left = Math.max(0, left - drawn.cost);
      whole &&= drawn.whole;
    });
    return whole;
  }
}

/**
 * Has `group` show the finest of its levels that costs no more than is allowed, or the coarsest.
 * @param {THREE.Group} group
 * @param {function(number): {object: THREE.Object3D, cost: number}} make the level, 0 the whole; called once for each
 */
export function drawByLevels(group, count, make) {
  const levels = [];
  const level = (i) => {
    if (!levels[i]) group.add((levels[i] = make(i)).object);
    return levels[i];
  };
  group.userData.draw = (allowed) => {
    let shown = 0;
    while (shown < count - 1 && level(shown).cost > allowed) ++shown;
    level(shown);
    levels.forEach((one, i) => { one.object.visible = i === shown; });
    return { cost: levels[shown].cost, whole: shown === 0 };
  };
}
