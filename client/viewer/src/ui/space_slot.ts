import type { Look } from '../draw';
import type { SpaceView } from '../space/camera';
import { DEFAULT_SPACE_LOOK, type SpaceLook } from '../space/look';
import type { SpaceEvents, SpacePicture } from '../space/picture';

/** The picture of surfaces in a pane. The pane makes it when it first shows a surface. */
export class SpaceSlot {
  /** Null until there is one. */
  picture: SpacePicture | null = null;
  private look: Look | null = null;
  private spaceLook: SpaceLook = DEFAULT_SPACE_LOOK;
  /** The view for the picture before there is one. */
  private firstView: SpaceView | null = null;

  /** `makePicture`: null if the pane cannot show surfaces. `canvas`: the picture comes before it. */
  constructor(private readonly makePicture: ((events: SpaceEvents) => SpacePicture) | null,
              private readonly events: SpaceEvents, private readonly canvas: HTMLElement) {}

  /** Whether the pane can show surfaces. */
  get isOffered(): boolean { return this.makePicture !== null; }

  /** The picture, if the pane shows it now. */
  get shown(): SpacePicture | null {
    return this.picture && !this.picture.element.hidden ? this.picture : null;
  }

  setLook(look: Look): void {
    this.look = look;
    this.picture?.setLook(look, this.spaceLook);
  }

  setSpaceLook(spaceLook: SpaceLook): void {
    this.spaceLook = spaceLook;
    if (this.look) this.picture?.setLook(this.look, spaceLook);
  }

  setView(view: SpaceView): void {
    if (this.picture) this.picture.setView(view);
    else this.firstView = view;
  }

  /** Shows or hides the picture. Makes it if there is none, with `label` for screen readers. */
  show(isShown: boolean, label: string): void {
    if (isShown) this.picture ??= this.newPicture(label);
    if (this.picture) this.picture.element.hidden = !isShown;
  }

  private newPicture(label: string): SpacePicture | null {
    if (!this.makePicture) return null;
    const picture = this.makePicture(this.events);
    picture.element.hidden = true;
    picture.canvas.setAttribute('aria-label', label);
    this.canvas.before(picture.element);
    if (this.look) picture.setLook(this.look, this.spaceLook);
    if (this.firstView) picture.setView(this.firstView);
    return picture;
  }
}
