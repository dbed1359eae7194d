import type { Vector } from '../space/camera';
import { CLIP_AXES, DEFAULT_SPACE_LOOK, parseSpaceLook, type SpaceLook, spaceLookText } from '../space/look';
import { byId, input, select } from './dom';

/** Controls of the look of surfaces, which are shown beside a picture of surfaces. */
export class SpacePanel {
  private chosen: SpaceLook = { ...DEFAULT_SPACE_LOOK };

  /** `direction`: returns the direction to the camera of the chosen picture; null without one. */
  constructor(private readonly changed: () => void, private readonly direction: () => Vector | null) {
    const form = byId('space-look', HTMLElement);
    form.addEventListener('change', () => this.read());
    input('clip-at').addEventListener('input', () => this.read());
    this.reflect();
  }

  get look(): SpaceLook { return this.chosen; }

  offer(isSpace: boolean, hasSections: boolean): void {
    byId('space-look', HTMLElement).hidden = !isSpace;
    input('planes').parentElement?.toggleAttribute('hidden', !hasSections);
  }

  /** The look in the page's address; empty if it is the default. */
  get text(): string { return spaceLookText(this.chosen); }

  set text(text: string) {
    this.chosen = parseSpaceLook(text);
    this.reflect();
    this.changed();
  }

  private read(): void {
    const clipAxis = CLIP_AXES.find((axis) => axis === select('clip-axis').value) ?? 'none';
    const isHeld = clipAxis === 'view' && input('clip-held').checked;
    this.chosen = {
      shading: select('shading').value === 'flat' ? 'flat' : 'smooth',
      isTranslucent: input('translucent').checked,
      isPerspective: select('projection').value === 'perspective',
      clipAxis,
      clipHeld: isHeld ? this.chosen.clipHeld ?? this.direction() : null,
      clipAt: input('clip-at').valueAsNumber,
      isClipFlipped: input('clip-flipped').checked,
      hasCutFaces: input('cut-faces').checked,
      hasPlanes: input('planes').checked,
    };
    this.reflect();
    this.changed();
  }

  private reflect(): void {
    const { shading, isTranslucent, isPerspective, clipAxis, clipAt, clipHeld, isClipFlipped, hasCutFaces, hasPlanes } = this.chosen;
    select('shading').value = shading;
    input('translucent').checked = isTranslucent;
    select('projection').value = isPerspective ? 'perspective' : 'parallel';
    select('clip-axis').value = clipAxis;
    input('clip-at').valueAsNumber = clipAt;
    input('clip-held').checked = clipHeld !== null;
    input('clip-flipped').checked = isClipFlipped;
    input('cut-faces').checked = hasCutFaces;
    input('planes').checked = hasPlanes;
    for (const element of byId('space-look', HTMLElement).querySelectorAll<HTMLElement>('[data-clip]')) {
      element.hidden = clipAxis === 'none' || (element.dataset.clip === 'view' && clipAxis !== 'view');
    }
  }
}
