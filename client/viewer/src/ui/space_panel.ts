import { CLIP_AXES, DEFAULT_SPACE_LOOK, parseSpaceLook, type SpaceLook, spaceLookText } from '../space/look';
import { byId, input, select } from './dom';

/** Controls of the look of surfaces, which are shown beside a picture of surfaces. */
export class SpacePanel {
  private chosen: SpaceLook = { ...DEFAULT_SPACE_LOOK };

  constructor(private readonly changed: () => void) {
    const form = byId('space-look', HTMLElement);
    form.addEventListener('change', () => this.read());
    input('clip-at').addEventListener('input', () => this.read());
    this.reflect();
  }

  get look(): SpaceLook { return this.chosen; }

  offer(isSpace: boolean): void {
    byId('space-look', HTMLElement).hidden = !isSpace;
  }

  /** The look in the page's address; empty if it is the default. */
  get text(): string { return spaceLookText(this.chosen); }

  set text(text: string) {
    this.chosen = parseSpaceLook(text);
    this.reflect();
    this.changed();
  }

  private read(): void {
    this.chosen = {
      shading: select('shading').value === 'flat' ? 'flat' : 'smooth',
      isTranslucent: input('translucent').checked,
      isPerspective: select('projection').value === 'perspective',
      clipAxis: CLIP_AXES.find((axis) => axis === select('clip-axis').value) ?? 'none',
      clipAt: input('clip-at').valueAsNumber,
      isClipFlipped: input('clip-flipped').checked,
    };
    this.reflect();
    this.changed();
  }

  private reflect(): void {
    const { shading, isTranslucent, isPerspective, clipAxis, clipAt, isClipFlipped } = this.chosen;
    select('shading').value = shading;
    input('translucent').checked = isTranslucent;
    select('projection').value = isPerspective ? 'perspective' : 'parallel';
    select('clip-axis').value = clipAxis;
    input('clip-at').valueAsNumber = clipAt;
    input('clip-flipped').checked = isClipFlipped;
    for (const element of byId('space-look', HTMLElement).querySelectorAll('[data-clip]')) {
      element.toggleAttribute('hidden', clipAxis === 'none');
    }
  }
}
