import { channelLabel } from '../protocol/channels';
import type { Frame } from '../protocol/frame';
import { attributeOf, DEFAULT_LOOK, type Look } from './look';
import { RingIndex } from './pick';
import { chosenRange, type Range, rampStops, widened } from './ramp';
import { Selection } from './selection';
import { SvgDrawing } from './svg_drawing';
import { type Drawing, Renderer } from './webgl/renderer';
import { boundsOf, fitBounds, toWorld, type Size, type View } from './view';

/** Distance at which the pointer is on a line, in CSS pixels. */
const PICK_TOLERANCE = 6;

/** Content of the canvas at a position. */
export interface Picked {
  /** World coordinates. */
  x: number;
  y: number;
  ring: number | null;
}

/** Range and colours of the attribute that the look colours by. */
export interface Legend {
  /** Name of the channel for the user. */
  name: string;
  min: number;
  max: number;
  /** Colours from the smallest to the largest number, in equal steps. */
  stops: string[];
}

/** The legend of a look; null without a channel to colour by, or without numbers of it so far. */
export function legendOf(look: Look, range: Range | null, channels: readonly string[]): Legend | null {
  const name = attributeOf(look);
  if (!range || name === null) return null;
  return { ...range, name: channelLabel(name, channels), stops: rampStops(look) };
}

/**
 * A canvas that shows one frame after another. Only `draw` draws: the caller calls it after changes
 * of frame, look, view, size or selection, once per refresh of the screen.
 */
export class Scene {
  view: View = { x: 0, y: 0, scale: 1 };
  /** The canvas in CSS pixels at the last `resize`. Reading it from the page in each drawing would cost a layout. */
  size: Size = { width: 0, height: 0 };
  /** Ring under the pointer. */
  hovered: number | null = null;
  /** Called after each drawing, in the same task. */
  drawn: (() => void) | null = null;
  /** Range of the attribute's colours if the look has none. Null: the range of all frames so far. */
  fixedRange: Range | null = null;
  /** Main-thread time of the last `show`, milliseconds. */
  lastUploadMs = 0;

  private readonly selection = new Selection();
  private drawing: Drawing | null;
  private look: Look = DEFAULT_LOOK;
  private frame: Frame | null = null;
  private index: RingIndex | null = null;
  private range: Range | null = null;
  private selected: readonly number[] = [];

  constructor(readonly canvas: HTMLCanvasElement) {
    this.drawing = this.newDrawing();
    canvas.addEventListener('webglcontextlost', this.onLost);
    canvas.addEventListener('webglcontextrestored', this.onRestored);
    this.resize();
  }

  /** Whether the canvas has the picture. Without WebGL, it is SVG beside the canvas. */
  get isOnCanvas(): boolean { return !(this.drawing instanceof SvgDrawing); }

  /** The selected rings of the frame: several after a split. */
  get selectedRings(): readonly number[] {
    return this.selected;
  }

  /**
   * Sets the frame to draw, or null. Keeps its arrays without a copy. If the frame is too large for
   * the graphics card, throws a RangeError and shows nothing.
   */
  show(frame: Frame | null): void {
    const begin = performance.now();
    this.frame = frame;
    this.index = null;
    this.hovered = null;
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

  /** Fits the view to the frame's rings, or to its particles if there are no rings. Without both, keeps the view. */
  fit(): void {
    if (!this.frame) return;
    const { rings, particles, origin } = this.frame;
    const bounds = boundsOf(rings.points, origin) ?? (particles && boundsOf(particles, origin));
    if (bounds) this.view = fitBounds(bounds, this.size);
  }

  /**
   * Adopts the size of the canvas on the page. If the size has changed, the canvas is empty until
   * `draw`.
   */
  resize(): void {
    this.size = { width: this.canvas.clientWidth, height: this.canvas.clientHeight };
    const width = Math.max(1, Math.round(this.size.width * devicePixelRatio));
    const height = Math.max(1, Math.round(this.size.height * devicePixelRatio));
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
  }

  draw(): void {
    this.drawing?.draw({
      frame: this.frame,
      look: this.look,
      view: this.view,
      ratio: this.canvas.width / Math.max(this.size.width, 1),
      range: this.attributes().length > 0 ? this.colourRange : null,
      selected: this.selected,
      hovered: this.hovered,
    });
    this.drawn?.();
  }

  /** Selects the ring of this identity and follows it through splits and merges; null for none. */
  select(identity: bigint | null): void {
    this.selection.start(identity);
    this.selected = this.frame ? this.selection.ringsOf(this.frame) : [];
  }

  /** Picks at CSS pixels from the upper left corner of the canvas. */
  pick(cssX: number, cssY: number): Picked {
    const [x, y] = toWorld(this.view, this.size, cssX, cssY);
    if (!this.frame) return { x, y, ring: null };
    this.index ??= new RingIndex(this.frame.rings);
    const [originX, originY] = this.frame.origin;
    const tolerance = PICK_TOLERANCE / this.view.scale;
    return { x, y, ring: this.index.ringAt(x - originX, y - originY, tolerance) };
  }

  /** Legend of the attribute that the look colours by; null without one. */
  legend(): Legend | null {
    return legendOf(this.look, this.colourRange, this.channels);
  }

  /** Names of the numbers that the frame can be coloured by. */
  get channels(): string[] {
    if (!this.frame) return [];
    const { rings, particleAttributes } = this.frame;
    return [...new Set([...rings.attributes.keys(), ...particleAttributes?.keys() ?? []])];
  }

  destroy(): void {
    this.canvas.removeEventListener('webglcontextlost', this.onLost);
    this.canvas.removeEventListener('webglcontextrestored', this.onRestored);
    this.drawing?.destroy();
    this.drawing = null;
    this.frame = null;
  }

  private prepare(): void {
    if (this.frame) this.drawing?.prepare(this.frame, this.look);
  }

  private newDrawing(): Drawing {
    const gl = this.canvas.getContext('webgl2', {
      alpha: false, antialias: false, depth: false, stencil: true, preserveDrawingBuffer: false,
    });
    return gl ? new Renderer(gl) : new SvgDrawing(this.canvas);
  }

  private get colourRange(): Range | null {
    if (!this.range) return null;
    return chosenRange(this.fixedRange ?? this.range, this.look.from, this.look.to);
  }

  /** The values of the look's attribute: of the mesh (or of the rings, if no mesh has them), and of the particles. */
  private attributes(): Float32Array[] {
    const name = attributeOf(this.look);
    if (name === null || !this.frame) return [];
    const { mesh, rings, particleAttributes } = this.frame;
    return [mesh?.attribute(name) ?? rings.attributes.get(name), particleAttributes?.get(name)]
      .filter((values) => values !== undefined);
  }

  /**
   * Widens the range of the colours to the values of the frame. A frame never narrows the range, so
   * colours change little from frame to frame. `restart`: first drops the earlier range.
   */
  private widenRange(restart: boolean): void {
    if (restart) this.range = null;
    for (const values of this.attributes()) this.range = widened(this.range, values);
  }

  private readonly onLost = (event: Event): void => {
    event.preventDefault();  // Otherwise the browser never restores the context.
    this.drawing = null;
  };

  private readonly onRestored = (): void => {
    this.drawing = this.newDrawing();
    this.prepare();
    this.draw();
  };
}
