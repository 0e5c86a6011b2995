// The sky of a model: a dome that stands still around the camera. Its horizon is what floors fade into.
import { THREE } from "./meshcat.js";
import { theme } from "./theme.js";
/** @import { Three } from "./types.d.ts" */

const VERTEX = `
  varying vec3 ray;
  uniform mat4 lens, turn; // from the picture to the camera, and from it to the world
  void main() {
    vec4 far = lens * vec4(position.xy, 1.0, 1.0);
    ray = mat3(turn) * far.xyz / far.w;
    gl_Position = vec4(position.xy, 1.0, 1.0);
  }`;

// most of a sky's colours is seen below 45 degrees, as cameras look down
const FRAGMENT = `
  varying vec3 ray;
  uniform vec3 zenith, horizon, nadir;
  void main() {
    float up = normalize(ray).y;
    vec3 end = up > 0.0 ? zenith : nadir;
    gl_FragColor = vec4(mix(horizon, end, smoothstep(0.0, 0.7, abs(up))), 1.0);
  }`;

// What is written over it stays readable: a dark page has a night of this brightness, on a light one
// so much of what a colour lacks to white is left
const NIGHT = 0.25;
const HAZE = 0.35;

/** @param {number[]} rgb */
const inTheme = (rgb) =>
  new THREE.Color(...rgb.map((v) => (theme() === "dark" ? NIGHT * v : 1 - HAZE * (1 - v))));

export class Sky {
  /** @param {Three} scene */
  constructor(scene) {
    const colours = ["zenith", "horizon", "nadir"];
    /** @type {Record<string, {value: Three}>} */
    this.uniforms = Object.fromEntries(colours.map((name) => [name, { value: null }]));
    const material = new THREE.ShaderMaterial({
      uniforms: { ...this.uniforms, lens: { value: null }, turn: { value: null } },
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      depthTest: false,
      depthWrite: false,
    });
    this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
    this.mesh.renderOrder = -2; // behind all
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
    this.mesh.onBeforeRender = (/** @type {Three[]} */ ...[, , lens]) => {
      material.uniforms.lens.value = lens.projectionMatrixInverse;
      material.uniforms.turn.value = lens.matrixWorld;
    };
    scene.add(this.mesh);
    /** @type {number[][] | null} */
    this.colours = null;
  }

  /** @param {number[][] | null} colours at its zenith, at its horizon and below, from 0 to 1 */
  show(colours) {
    this.colours = colours;
    this.restyle();
  }

  restyle() {
    this.mesh.visible = this.colours !== null;
    Object.values(this.uniforms).forEach((uniform, k) => {
      uniform.value = this.colours && inTheme(this.colours[k]);
    });
  }

  /** What is far fades into it; null without a sky. */
  get horizon() {
    return this.uniforms.horizon.value;
  }
}
