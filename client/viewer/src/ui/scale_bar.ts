import type { View } from '../draw';
import { make, setText } from './dom';
import { number } from './format';

const MOST_PIXELS = 120;

/** A bar with a round length in world units. */
export class ScaleBar {
  readonly element = make('div', { class: 'scale' }, make('span'), make('i'));

  show({ scale }: View): void {
    const [text, bar] = this.element.children as unknown as [HTMLElement, HTMLElement];
    const longest = MOST_PIXELS / scale;
    const power = 10 ** Math.floor(Math.log10(longest));
    const length = [5, 2, 1].map((digit) => digit * power).find((size) => size <= longest) ?? longest;
    setText(text, number(length, 2));
    bar.style.width = `${length * scale}px`;
  }
}
