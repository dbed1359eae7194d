import type { Scene } from '../draw/scene';
import { drawMarks, type Mark } from './marks';

/** The members of a scene that exports use. */
export type Drawn = Pick<Scene, 'draw' | 'drawn' | 'canvas' | 'size' | 'isOnCanvas'>;

/** The last drawing of a scene with its marks, on a canvas of its own. */
export class CanvasCopy {
  readonly canvas = document.createElement('canvas');
  private readonly context: CanvasRenderingContext2D;
  private width = 0;
  private height = 0;

  /** Throws if the scene draws SVG instead of its canvas. */
  constructor(private readonly scene: Drawn, private readonly marks: () => readonly Mark[]) {
    const context = this.canvas.getContext('2d');
    if (!context || !scene.isOnCanvas) {
      throw new Error('This browser draws without WebGL. Save the picture as SVG.');
    }
    this.context = context;
  }

  /**
   * Copies the scene. Requires that it was drawn in this task: the browser clears the drawing afterwards. A coarser
   * drawing of the same size on the page is scaled up, so that the pixels of a clip do not change.
   */
  update(): void {
    const { canvas, size } = this.scene;
    const isSameSize = size.width === this.width && size.height === this.height;
    if (!isSameSize || canvas.width > this.canvas.width) {
      [this.width, this.height] = [size.width, size.height];
      if (this.canvas.width !== canvas.width) this.canvas.width = canvas.width;
      if (this.canvas.height !== canvas.height) this.canvas.height = canvas.height;
    }
    this.context.drawImage(canvas, 0, 0, this.canvas.width, this.canvas.height);
    drawMarks(this.context, this.marks(), this.canvas.width / Math.max(1, size.width));
  }
}
