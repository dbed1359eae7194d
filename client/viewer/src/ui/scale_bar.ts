import type { View } from '../draw';
import { scaleLength } from '../draw/scale';
import { make, setText } from './dom';
import { number } from './format';

/** A bar with a round length in world units. */
export class ScaleBar {
  readonly element = make('div', { class: 'scale' }, make('span'), make('i'));
  private width = '';

  show(view: View): void {
    const [text, bar] = this.element.children as unknown as [HTMLElement, HTMLElement];
    const length = scaleLength(view);
    setText(text, number(length, 2));
    const width = `${length * view.scale}px`;
    if (width === this.width) return;
    this.width = width;
    bar.style.width = width;
  }
}
