import type { Scene } from '../draw/scene';

/**
 * The canvas as PNG, in device pixels. Draws and reads in one task, because the browser clears the
 * drawing after the task.
 */
export function png(scene: Pick<Scene, 'draw' | 'canvas'>): Promise<Blob> {
  return new Promise((resolve, reject) => {
    scene.draw();
    scene.canvas.toBlob((blob) => {
      if (blob) resolve(blob);
      else reject(new Error('The browser could not save the canvas. Try a smaller window.'));
    }, 'image/png');
  });
}
