import { svg } from '../export/svg';
import type { Drawing, Picture } from './webgl/renderer';

export const NO_WEBGL = 'This browser has no WebGL2, so pictures are drawn slowly.';

/** Draws by SVG, for browsers without WebGL2. Slower, with the same colours. */
export class SvgDrawing implements Drawing {
  private readonly element = document.createElement('div');

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.element.style.cssText = 'position: absolute; inset: 0; pointer-events: none';
    canvas.after(this.element);
  }

  prepare(): void {}

  draw({ frame, look, view, range, selected, hovered }: Picture): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const marked = hovered === null ? selected : [...selected, hovered];
    this.element.innerHTML = frame ? svg(frame, look, view, { width, height }, range, marked) : '';
  }

  destroy(): void {
    this.element.remove();
  }
}
