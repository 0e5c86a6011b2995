// The ground: a grid about a pixel wide at any distance, and the lane of robots in a row.
import { THREE } from "./meshcat.js";
/** @import { Three } from "./types.d.ts" */

const VERTEX = `
  varying vec2 at;
  uniform float size;
  void main() {
    at = position.xy * size;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;

// lines that fade out around the middle of the view
const FRAGMENT = `
  varying vec2 at;
  uniform vec3 colour;
  uniform vec2 middle;
  uniform float minor, major, reach, lane, laneWidth, strength;
  float lines(float spacing) {
    vec2 width = fwidth(at / spacing);
    vec2 away = abs(fract(at / spacing - 0.5) - 0.5) / max(width, 1e-6);
    vec2 drawn = (1.0 - min(away, 1.0)) * clamp(0.5 / width - 0.5, 0.0, 1.0);
    return max(drawn.x, drawn.y);
  }
  void main() {
    float alpha = max(0.35 * lines(minor), 0.8 * lines(major));
    float inside = laneWidth > 0.0 ? 1.0 - step(laneWidth, abs(at.y - lane)) : 0.0;
    alpha = max(alpha, 0.16 * inside);
    float fade = 1.0 - smoothstep(0.25, 1.0, length(at - middle) / reach);
    gl_FragColor = vec4(colour, strength * alpha * fade);
  }`;

export class Ground {
  /** @param {Three} scene */
  constructor(scene) {
    const uniform = (/** @type {any} */ value) => ({ value });
    this.uniforms = {
      size: uniform(1),
      colour: uniform(new THREE.Color()),
      middle: uniform(new THREE.Vector2()),
      minor: uniform(1),
      major: uniform(10),
      reach: uniform(30),
      lane: uniform(0),
      laneWidth: uniform(0),
      strength: uniform(0.6),
    };
    const material = new THREE.ShaderMaterial({
      uniforms: this.uniforms,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      polygonOffset: true, // behind a lane's floor, also where that is seen at a grazing angle
      polygonOffsetFactor: 4,
      polygonOffsetUnits: 4,
      side: THREE.DoubleSide,
      extensions: { derivatives: true },
    });
    this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), material);
    this.mesh.renderOrder = -1;
    this.mesh.frustumCulled = false;
    scene.add(this.mesh);
    this.major = 10; // m between the stronger lines
  }

  /**
   * Follows the point that the camera looks at, in whole squares, so that lines stand still.
   * @param {number[]} target
   * @param {number} distance
   * @param {number} floor
   * @param {number[] | null} lane its least and greatest y
   */
  place(target, distance, floor, lane) {
    const u = this.uniforms;
    const minor = distance < 45 ? 1 : distance < 200 ? 5 : 25;
    this.major = 10 * minor;
    const { major } = this;
    const snap = (/** @type {number} */ v) => Math.round(v / major) * major;
    const reach = Math.max(8, 4 * distance);
    const origin = [snap(target[0]), snap(target[1])];
    this.mesh.position.set(origin[0], origin[1], floor - 0.02); // below a model's own floor
    this.mesh.scale.setScalar(2 * reach + major);
    u.size.value = 2 * reach + major;
    [u.minor.value, u.major.value, u.reach.value] = [minor, major, reach];
    u.middle.value.set(target[0] - origin[0], target[1] - origin[1]);
    const [low, high] = lane ?? [0, 0];
    u.laneWidth.value = lane === null ? 0 : 0.75 + (high - low) / 2;
    u.lane.value = (low + high) / 2 - origin[1];
  }
}
