import { ARROWS, attachGestures, FAST, KEY_ZOOM } from '../draw/gestures';
import { type Box, type Camera, panBy, type SpaceView, turnBy, zoomAt } from './camera';

/** The part of a scene that navigation uses. */
export interface Turnable { view: SpaceView; readonly camera: Camera; readonly extent: Box | null; fit(): void }

/** Turn and pan per key press, in CSS pixels of a drag. */
const KEY_PIXELS = 24;

/** Applies a key: arrows turn, with Shift they pan; + and - zoom, 0 fits. Returns false for other keys. */
export function applySpaceKey(scene: Turnable, key: string, shift: boolean): boolean {
  const { camera } = scene;
  const { width, height } = camera.size;
  const arrow = ARROWS[key];
  if (arrow && shift) scene.view = panBy(camera, arrow[0] * FAST * KEY_PIXELS, arrow[1] * FAST * KEY_PIXELS);
  else if (arrow) scene.view = turnBy(scene.view, camera.size, arrow[0] * KEY_PIXELS, arrow[1] * KEY_PIXELS);
  else if (key === '+' || key === '=') scene.view = zoomAt(camera, width / 2, height / 2, KEY_ZOOM, scene.extent);
  else if (key === '-' || key === '_') scene.view = zoomAt(camera, width / 2, height / 2, 1 / KEY_ZOOM, scene.extent);
  else if (key === '0') scene.fit();
  else return false;
  return true;
}

/**
 * Turns by a drag; pans by a drag with Shift or another button or two fingers; zooms and takes keys (`attachGestures`).
 * Returns a function: true during a drag.
 */
export function attachSpaceNavigation(canvas: HTMLCanvasElement, scene: Turnable, onChange: () => void,
  scrolls = false): () => boolean {
  let isPanning = false;
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  const { isDragging } = attachGestures(canvas, {
    press: ({ shiftKey, button }) => {
      isPanning = shiftKey || button !== 0;
      return true;
    },
    drag: (right, down, hasTwo) => {
      scene.view = isPanning || hasTwo ? panBy(scene.camera, right, down) : turnBy(scene.view, scene.camera.size, right, down);
    },
    zoom: (x, y, factor) => { scene.view = zoomAt(scene.camera, x, y, factor, scene.extent); },
    key: (key, shift) => applySpaceKey(scene, key, shift),
  }, onChange, scrolls);
  return isDragging;
}
