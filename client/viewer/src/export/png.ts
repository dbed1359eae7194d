import type { Scene } from '../draw/scene';

/**
 * What is seen, in device pixels. It is drawn and read in one task, as the browser drops a drawing
 * once the task that made it has ended.
 */
export function png(scene: Pick<Scene, 'draw' | 'canvas'>): Promise<Blob> {
  return new Promise((resolve, reject) => {
    scene.draw();
    scene.canvas.toBlob((blob) => {
      if (blob) resolve(blob);
      else reject(new Error('The browser made no picture of the canvas. Try a smaller window.'));
    }, 'image/png');
  });
}
