import { ARROWS, attachGestures, FAST, KEY_ZOOM } from './gestures';
import { panBy, zoomAt, type Size, type View } from './view';

/** The part of a scene that navigation uses. */
export interface Navigable {
  view: View;
  readonly size: Size;
  fit(): void;
}

/** Pan per key press, in CSS pixels. */
const KEY_PAN = 48;

/**
 * Applies a key to the view: arrows pan, + and - zoom about the centre, 0 fits. Returns false for
 * other keys.
 */
export function applyKey(scene: Navigable, key: string, fast: boolean): boolean {
  const { width, height } = scene.size;
  const arrow = ARROWS[key];
  if (arrow) {
    const step = fast ? FAST * KEY_PAN : KEY_PAN;
    scene.view = panBy(scene.view, arrow[0] * step, arrow[1] * step);
  } else if (key === '+' || key === '=') {
    scene.view = zoomAt(scene.view, scene.size, width / 2, height / 2, KEY_ZOOM);
  } else if (key === '-' || key === '_') {
    scene.view = zoomAt(scene.view, scene.size, width / 2, height / 2, 1 / KEY_ZOOM);
  } else if (key === '0') {
    scene.fit();
  } else {
    return false;
  }
  return true;
}

/** Pans and zooms the scene by gestures (`attachGestures`). Returns a function that detaches everything. */
export function attachNavigation(
  canvas: HTMLCanvasElement, scene: Navigable, onChange: () => void, scrolls = false,
): () => void {
  const { detach } = attachGestures(canvas, {
    press: ({ pointerType, button }) => pointerType !== 'mouse' || button === 0 || button === 1,
    drag: (right, down) => { scene.view = panBy(scene.view, right, down); },
    zoom: (x, y, factor) => { scene.view = zoomAt(scene.view, scene.size, x, y, factor); },
    key: (key, shift) => applyKey(scene, key, shift),
  }, onChange, scrolls);
  return detach;
}
