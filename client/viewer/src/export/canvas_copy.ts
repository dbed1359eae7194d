import type { Scene } from '../draw/scene';
import { drawMarks, type Mark } from './marks';

/** The members of a scene that exports use. */
export type Drawn = Pick<Scene, 'draw' | 'drawn' | 'canvas' | 'size' | 'isOnCanvas'>;

/** The last drawing of a scene with its marks, on a canvas of its own. */
export class CanvasCopy {
  readonly canvas = document.createElement('canvas');
  private readonly context: CanvasRenderingContext2D;

  /** Throws if the scene draws SVG instead of its canvas. */
  constructor(private readonly scene: Drawn, private readonly marks: () => readonly Mark[]) {
    const context = this.canvas.getContext('2d');
    if (!context || !scene.isOnCanvas) {
      throw new Error('This browser draws without WebGL. Save the picture as SVG.');
    }
    this.context = context;
  }

  /** Copies the scene. Requires that it was drawn in this task: the browser clears the drawing afterwards. */
  update(): void {
    const { width, height } = this.scene.canvas;
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    this.context.drawImage(this.scene.canvas, 0, 0);
    drawMarks(this.context, this.marks(), width / Math.max(1, this.scene.size.width));
  }
}
