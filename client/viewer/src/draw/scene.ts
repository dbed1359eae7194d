import type { Frame } from '../protocol/frame';
import { attributeOf, DEFAULT_LOOK, type Look } from './look';
import { RingIndex } from './pick';
import { type Range, rampStops, rangeOf } from './ramp';
import { Renderer } from './webgl/renderer';
import { Selection } from './selection';
import { boundsOf, fitBounds, toWorld, type Size, type View } from './view';

/** How near to a line the pointer is on it, in CSS pixels. */
const PICK_TOLERANCE = 6;

/** What a place of the canvas shows. */
export interface Picked {
  /** World coordinates. */
  x: number;
  y: number;
  ring: number | null;
}

/** Numbers and colours of the attribute that rings are coloured by. */
export interface Legend {
  min: number;
  max: number;
  /** From the smallest to the largest number, in equal steps. */
  stops: string[];
}

/**
 * A canvas that shows one frame after another. Nothing is drawn but by `draw`; whoever changes
 * frame, look, view, size or selection calls it, once per refresh of the screen.
 */
export class Scene {
  view: View = { x: 0, y: 0, scale: 1 };
  /** Main-thread time of the last `show`, milliseconds. */
  lastUploadMs = 0;

  private readonly gl: WebGL2RenderingContext;
  private readonly selection = new Selection();
  private renderer: Renderer | null;
  private look: Look = DEFAULT_LOOK;
  private frame: Frame | null = null;
  private index: RingIndex | null = null;
  private range: Range | null = null;
  private selected: readonly number[] = [];

  /** Throws where the browser cannot draw (no WebGL2). */
  constructor(readonly canvas: HTMLCanvasElement) {
    const gl = canvas.getContext('webgl2', {
      alpha: false, antialias: false, depth: false, stencil: true, preserveDrawingBuffer: false,
    });
    if (!gl) {
      throw new Error('This browser cannot draw here: WebGL2 is off or missing. Turn on hardware ' +
        'acceleration, or use a newer browser.');
    }
    this.gl = gl;
    this.renderer = new Renderer(gl);
    canvas.addEventListener('webglcontextlost', this.onLost);
    canvas.addEventListener('webglcontextrestored', this.onRestored);
    this.resize();
  }

  /** The canvas in CSS pixels. */
  get size(): Size {
    return { width: this.canvas.clientWidth, height: this.canvas.clientHeight };
  }

  /** The rings of the frame that are selected: several after a split. */
  get selectedRings(): readonly number[] {
    return this.selected;
  }

  /**
   * The frame that is drawn from now on; null for none. Its arrays are kept, not copied. Throws a
   * RangeError, and goes on showing nothing, where the graphics card has no room for it.
   */
  show(frame: Frame | null): void {
    const begin = performance.now();
    this.frame = frame;
    this.index = null;
    this.selected = frame ? this.selection.ringsOf(frame) : [];
    this.widenRange(frame === null);
    try {
      this.prepare();
    } catch (error) {
      this.frame = null;
      throw error;
    } finally {
      this.lastUploadMs = performance.now() - begin;
    }
  }

  setLook(look: Look): void {
    const otherColour = look.colour !== this.look.colour;
    this.look = { ...look };
    this.widenRange(otherColour);
    this.prepare();
  }

  /** Shows all of the frame. Without one, or where it is empty, the view stays. */
  fit(): void {
    if (!this.frame) return;
    const { rings, particles, origin } = this.frame;
    const bounds = boundsOf(rings.points, origin) ?? (particles && boundsOf(particles, origin));
    if (bounds) this.view = fitBounds(bounds, this.size);
  }

  /**
   * Takes over the size of the canvas on the page, and the screen's pixels per CSS pixel. Where
   * they have changed, the canvas is empty until `draw`.
   */
  resize(): void {
    const width = Math.max(1, Math.round(this.size.width * devicePixelRatio));
    const height = Math.max(1, Math.round(this.size.height * devicePixelRatio));
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
  }

  draw(): void {
    if (!this.renderer || this.gl.isContextLost()) return;
    this.renderer.draw({
      frame: this.frame,
      look: this.look,
      view: this.view,
      ratio: this.canvas.width / Math.max(this.size.width, 1),
      range: this.attribute() && this.range,
      selected: this.selected,
    });
  }

  /** Marks the ring of this identity, now and as it splits and merges; null for none. */
  select(identity: bigint | null): void {
    this.selection.start(identity);
    this.selected = this.frame ? this.selection.ringsOf(this.frame) : [];
  }

  /** What lies at CSS pixels from the canvas's upper left corner. */
  pick(cssX: number, cssY: number): Picked {
    const [x, y] = toWorld(this.view, this.size, cssX, cssY);
    if (!this.frame) return { x, y, ring: null };
    this.index ??= new RingIndex(this.frame.rings);
    const [originX, originY] = this.frame.origin;
    const tolerance = PICK_TOLERANCE / this.view.scale;
    return { x, y, ring: this.index.ringAt(x - originX, y - originY, tolerance) };
  }

  /** Of the attribute that the look colours by; null where there is none. */
  legend(): Legend | null {
    if (!this.range) return null;
    return { ...this.range, stops: rampStops(this.look.dark) };
  }

  destroy(): void {
    this.canvas.removeEventListener('webglcontextlost', this.onLost);
    this.canvas.removeEventListener('webglcontextrestored', this.onRestored);
    this.renderer?.destroy();
    this.renderer = null;
    this.frame = null;
  }

  private prepare(): void {
    if (this.frame && this.renderer && !this.gl.isContextLost()) {
      this.renderer.textures.prepare(this.frame, this.look);
    }
  }

  private attribute(): Float32Array | null {
    const name = attributeOf(this.look);
    return (name !== null && this.frame?.rings.attributes.get(name)) || null;
  }

  /** The range grows from frame to frame: a colour keeps its meaning while a stream runs. */
  private widenRange(anew: boolean): void {
    if (anew) this.range = null;
    const values = this.attribute();
    const range = values && rangeOf(values);
    if (!range) return;
    this.range = this.range
      ? { min: Math.min(range.min, this.range.min), max: Math.max(range.max, this.range.max) }
      : range;
  }

  private readonly onLost = (event: Event): void => {
    event.preventDefault(); // Else the browser never gives it back.
    this.renderer = null;
  };

  private readonly onRestored = (): void => {
    this.renderer = new Renderer(this.gl);
    this.prepare();
    this.draw();
  };
}
