/** Drawing: frames on a canvas by WebGL2, moving about in them, asking what is where. */
export { DEFAULT_LOOK, type Look } from './look';
export { attachNavigation } from './navigation';
export { Scene, type Legend, type Picked } from './scene';
export type { Size, View } from './view';
