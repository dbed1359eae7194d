/** Draws frames on a canvas, pans and zooms, and finds the ring at a position. */
export { DEFAULT_LOOK, type Look } from './look';
export { attachNavigation } from './navigation';
export { NO_WEBGL } from './svg_drawing';
export { Scene, type Legend, type Picked } from './scene';
export type { Size, View } from './view';
