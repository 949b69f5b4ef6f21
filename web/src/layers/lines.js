// Lines some pixels wide.
import { InstancedBufferAttribute } from 'three';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';

const ofStart = 'vec4 end = modelViewMatrix * vec4( instanceEnd, 1.0 );', atEnd = '#include <fog_vertex>';

/** Leaves out lines of surfaces that are seen from behind. */
function hideBacks(shader) {
  shader.vertexShader = `attribute vec3 facing;\n${shader.vertexShader}`
    .replace(ofStart, `${ofStart}\nbool hidden = dot((modelViewMatrix * vec4(facing, 0.0)).xyz, start.xyz) > 0.0;`)
    .replace(atEnd, `${atEnd}\nif (hidden) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);`);
}

export class Lines {
  ends = [];
  colors = [];
  facing = [];

  /** @param {number[]?} facing the normal of what it lies on; null: seen from everywhere */
  add(from, to, color, facing = null) {
    this.ends.push(...from, ...to);
    this.colors.push(...color, ...color);
    this.facing.push(...(facing ?? [0, 0, 0]));
  }

  get count() { return this.ends.length / 6; }

  /** @param {number} width in pixels of the page */
  object(width) {
    const geometry = new LineSegmentsGeometry().setPositions(this.ends).setColors(this.colors);
    geometry.setAttribute('facing', new InstancedBufferAttribute(Float32Array.from(this.facing), 3));
    const material = new LineMaterial({ vertexColors: true, linewidth: width });
    material.onBeforeCompile = hideBacks;
    const object = new LineSegments2(geometry, material);
    object.frustumCulled = false;
    return object;
  }
}
