// Fewer pixels where pictures take long.
/** @import { Scene } from "./scene.js" */

const PICTURE = 0.016; // s between pictures, where nothing is slow
const SLOW = 0.05; // s, from which on pictures are coarser
const COARSE = 0.6; // of the pixels in a row

export class Pace {
  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
    this.usual = PICTURE; // s between pictures
  }

  /**
   * @param {number} passed s since the picture before
   * @param {boolean} playing
   */
  watch(passed, playing) {
    if (!playing) {
      this.usual = PICTURE;
      return this.scene.setQuality(1);
    }
    this.usual += 0.1 * (passed - this.usual);
    if (this.usual > SLOW) this.scene.setQuality(COARSE);
  }
}
