// Light from above, and from where a model's own lights are. All of it is white, since a robot's colour
// tells how much of its bounds it uses.
import { THREE } from "./meshcat.js";
/** @import { Light, Three } from "./types.d.ts" */

const OWN = { above: 0.72, rest: 0.5 }; // intensities where models have no lights
const MODELS = { above: 0.7, rest: 0.3 }; // together what a white surface can show
/** @type {Light} */
const SUN = { from: [[-3, -7, 9, 1]], head: 0 };

export class Lights {
  /** @param {Three} scene */
  constructor(scene) {
    this.scene = scene;
    this.above = new THREE.HemisphereLight(0xffffff, 0x8890a0);
    this.above.position.set(0, 0, 1);
    this.head = new THREE.DirectionalLight(0xffffff);
    scene.add(this.above, this.head, this.head.target);
    /** @type {Three[]} */
    this.suns = [];
    this.show(null);
  }

  /** @param {Light | null} light of a model that has some */
  show(light) {
    const { above, rest } = light ? MODELS : OWN;
    const { from, head } = light ?? SUN;
    this.scene.remove(...this.suns);
    this.suns = from.map(([x, y, z, part]) => {
      const sun = new THREE.DirectionalLight(0xffffff, rest * part); // toward the origin
      sun.position.set(x, y, z);
      return sun;
    });
    this.scene.add(...this.suns);
    this.above.intensity = above;
    this.head.intensity = rest * head;
    this.head.visible = head > 0;
  }

  /**
   * The light at the camera looks where that does.
   * @param {Three} direction from what it looks at to the camera, as three.js sees it
   */
  place({ x, y, z }) {
    this.head.position.set(x, -z, y);
  }
}
