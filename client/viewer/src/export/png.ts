import { CanvasCopy, type Drawn } from './canvas_copy';
import type { Mark } from './marks';

/** The scene with its marks as PNG, in device pixels. */
export function png(scene: Drawn, marks: readonly Mark[]): Promise<Blob> {
  return new Promise((resolve, reject) => {
    const copy = new CanvasCopy(scene, () => marks);
    scene.draw();
    copy.update();
    copy.canvas.toBlob((blob) => {
      if (blob) resolve(blob);
      else reject(new Error('The browser could not save the canvas. Try a smaller window.'));
    }, 'image/png');
  });
}
