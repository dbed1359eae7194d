import type { Scene } from '../draw';
import { type Bounds, fitBounds, union } from '../draw/view';

/** Keeps the content of a scene in view, until the user moves the view. */
export class FollowedView {
  /** Whether the view follows the content. False once the user has moved it. */
  isFree = true;
  /** Bounds of all content since the view follows it. */
  private extent: Bounds | null = null;

  /** `moved`: called when the view has grown with the content. */
  constructor(private readonly scene: Pick<Scene, 'view' | 'size'>, private readonly moved: () => void) {}

  /** Forgets the content so far. */
  restart(): void {
    this.extent = null;
  }

  /** Lets the view follow the content again, from now on. */
  follow(): void {
    this.isFree = true;
    this.extent = null;
  }

  /** Grows the view to include these bounds, unless the user has moved it. */
  include(bounds: Bounds | null): void {
    if (!this.isFree || !bounds) return;
    const extent = this.extent ? union(this.extent, bounds) : bounds;
    if (this.extent && isSame(extent, this.extent)) return;
    this.extent = extent;
    this.fit(extent);
  }

  /** Call after the canvas has changed its size. */
  resize(): void {
    if (this.isFree && this.extent) this.fit(this.extent);
  }

  private fit(extent: Bounds): void {
    this.scene.view = fitBounds(extent, this.scene.size);
    this.moved();
  }
}

function isSame(a: Bounds, b: Bounds): boolean {
  return a.left === b.left && a.bottom === b.bottom && a.right === b.right && a.top === b.top;
}
