// What is around robots: sky and lights of their models, the page's own ground, and what is far fades.
import { Ground } from "./ground.js";
import { Lights } from "./lights.js";
import { THREE } from "./meshcat.js";
import { Sky } from "./sky.js";
import { colour, theme } from "./theme.js";
/** @import { Camera } from "./camera.js" */
/** @import { Layout } from "./layout.js" */
/** @import { Scene as Meta, Three } from "./types.d.ts" */

const FADES = [2.5, 8]; // distances of the camera between which what is far fades

export class Surroundings {
  /** @param {Three} scene */
  constructor(scene) {
    this.scene = scene;
    this.sky = new Sky(scene);
    this.lights = new Lights(scene);
    this.ground = new Ground(scene);
  }

  /** @param {Meta} meta of which the first system that has a sky, or lights, gives them */
  setMeta({ systems }) {
    this.sky.show(systems.find(({ sky }) => sky)?.sky ?? null);
    this.lights.show(systems.find(({ light }) => light)?.light ?? null);
    this.ground.mesh.visible = systems.every(({ floor }) => floor === null);
    this.restyle();
  }

  restyle() {
    const { uniforms } = this.ground;
    uniforms.colour.value.set(colour("grid"));
    uniforms.strength.value = theme() === "dark" ? 0.75 : 0.85;
    this.sky.restyle();
    // a floor without an end fades into the sky or the page, and not into a grey line
    this.scene.fog = new THREE.Fog(this.sky.horizon ?? colour("sky-middle"), 1, 2);
  }

  /**
   * Goes with the camera.
   * @param {Camera} camera
   * @param {Layout} layout
   */
  place(camera, { floor, lane }) {
    const { x, y, z } = camera.controls.target;
    const { direction, distance } = camera.arm();
    const { fog } = this.scene;
    [fog.near, fog.far] = FADES.map((times) => times * Math.max(distance, 5));
    this.lights.place(direction);
    this.ground.place([x, -z, y], distance, floor, lane);
  }
}
