import type { Look } from '../draw/look';
import type { Mark } from '../export/marks';
import { marksOf } from '../export/marks';
import { hex, theme } from '../draw/colours';
import type { Frame } from '../protocol/frame';
import type { Surface, SurfaceMessage } from '../protocol/surface';
import type { Outline } from '../protocol/sections';
import { make, makeSvg, setText } from '../ui/dom';
import { count, number } from '../ui/format';
import { ScaleBar } from '../ui/scale_bar';
import { axesDrawing, type AxesDrawing } from './axes';
import { type SpaceView, unitsPerPixel, type Vector, viewText } from './camera';
import type { SpaceModule } from './drawing';
import type { SpaceLook } from './look';
import { applySpaceKey, attachSpaceNavigation } from './navigation';
import { type PickedShell, spaceFrameOf, SpaceScene } from './scene';
import { shellAt } from './shells';

export interface SpaceEvents {
  /** The view changed: by the user, or to keep the content in view. */
  moved(byUser: boolean): void;
  /** The user selected the body at a world position, or none. */
  selected(point: Vector | null): void;
  /** A frame is shown now. */
  shown(frame: Frame): void;
}

/** Loads the drawing of a picture, and decodes its surfaces. Both reject with an Error whose message is a sentence. */
export interface SpaceSource {
  load(): Promise<SpaceModule>;
  decode(message: SurfaceMessage): Promise<Surface>;
}

/** Margin of a shell's box, as a share of the box, for a selected point that rounding puts outside it. */
const ROUNDING = 1e-3;

/** The picture of surfaces in a pane. It decodes frames one at a time; a newer frame replaces a waiting one. */
export class SpacePicture {
  readonly canvas = make('canvas', { tabindex: '0', role: 'application', 'aria-roledescription': '3D picture' });
  readonly element: HTMLElement;
  readonly scene = new SpaceScene(this.canvas);
  /** Whether the view follows the content. False once the user has moved it. */
  isFree = true;
  /** Why the browser cannot draw, and why the frame cannot be shown; or empty. */
  private drawingProblem = '';
  private frameProblem = '';
  private readonly axes = makeSvg('svg', { class: 'overlay', 'aria-hidden': 'true' });
  private readonly readout = make('div', { class: 'readout' });
  private readonly scaleBar = new ScaleBar();
  private readonly isDragging: () => boolean;
  private readonly observer = new ResizeObserver(() => this.resized());
  private pointer: [number, number] | null = null;
  private selected: bigint | null = null;
  private hasAxes = false;
  private dirty = true;
  private isClosed = false;
  private isDecoding = false;
  /** Counts calls of `clear`. A frame is dropped if `clear` was called after its decoding had begun. */
  private era = 0;
  private waiting: { frame: Frame; outlines: readonly Outline[] } | null = null;

  /** `scrolls`: as of attachGestures. */
  constructor(private readonly events: SpaceEvents, private readonly source: SpaceSource, scrolls = false) {
    this.element = make('div', { class: 'space' }, this.canvas, this.axes, this.scaleBar.element, this.readout);
    this.isDragging = attachSpaceNavigation(this.canvas, this.scene, () => {
      this.isFree = false;
      this.dirty = true;
      events.moved(true);
    }, scrolls);
    this.listen();
    this.observer.observe(this.canvas);
    void this.load();
  }

  /** Why nothing is shown, or empty. */
  get problem(): string { return this.drawingProblem || this.frameProblem; }

  /** Shows a frame as soon as it is decoded. */
  show(frame: Frame, outlines: readonly Outline[]): void {
    this.waiting = { frame, outlines };
    if (!this.isDecoding) void this.decode();
  }

  clear(): void {
    this.waiting = null;
    ++this.era;
    this.frameProblem = '';
    this.scene.clear();
    this.dirty = true;
  }

  setLook(look: Look, spaceLook: SpaceLook): void {
    this.scene.setLook(look, spaceLook);
    this.hasAxes = look.axes;
    this.dirty = true;
  }

  setView(view: SpaceView): void {
    this.scene.view = { ...view };
    this.isFree = false;
    this.dirty = true;
  }

  /** Zooms about the middle by a key, as in the focused picture. */
  zoom(key: string): void {
    applySpaceKey(this.scene, key, false);
    this.isFree = false;
    this.dirty = true;
    this.events.moved(true);
  }

  fit(): void {
    this.isFree = true;
    this.scene.fit();
    this.dirty = true;
  }

  /** Selects the shell at a world position, or none: the smallest one whose box contains it. */
  selectAt(point: Vector | null): void {
    const { frame } = this.scene;
    const shell = frame && point && shellAt(frame.surface, point, ROUNDING);
    this.select(frame && shell !== null ? frame.surface.identities[shell] : null);
  }

  /** Selects the shell of this identity. Null, and 0 for a shell without identity, select nothing. */
  select(identity: bigint | null): void {
    this.selected = identity || null;
    this.scene.select(identity);
    this.dirty = true;
  }

  /** Draws if anything has changed. Returns the frame that it has drawn, if any. */
  refresh(): Frame | null {
    if (!this.dirty || this.element.hidden) return null;
    this.dirty = false;
    this.scene.draw();
    this.scaleBar.show(this.flatView);
    this.drawAxes();
    this.updateReadout();
    return this.scene.isDrawing ? this.scene.frame?.frame ?? null : null;
  }

  /** Caption, scale, legend and axes for exports. */
  marks(caption: string, dark: boolean): Mark[] {
    const { scene } = this;
    const marks = marksOf(caption, scene.size, this.flatView, scene.legend(), dark);
    const { lines, texts } = this.axesNow();
    const colour = hex(theme(dark).outline);
    const halo = hex(theme(dark).background);
    return [
      ...lines.map(([ax, ay, bx, by]): Mark => ({ kind: 'line', points: [[ax, ay], [bx, by]], width: 1, colour })),
      ...texts.map(({ x, y, text }): Mark => ({ kind: 'text', x, y, text, align: 'centre', colour, halo })),
      ...marks,
    ];
  }

  destroy(): void {
    this.isClosed = true;
    this.observer.disconnect();
    this.scene.destroy();
    this.element.remove();
  }

  /** A view with the scale at the camera's target, for the scale bar. */
  private get flatView() {
    return { x: 0, y: 0, scale: 1 / unitsPerPixel(this.scene.camera) };
  }

  private async load(): Promise<void> {
    try {
      const { createDrawing } = await this.source.load();
      if (!this.isClosed) this.scene.attach(createDrawing(this.canvas));
    } catch (error) {
      this.drawingProblem = textOf(error);
    }
    this.dirty = true;
  }

  private async decode(): Promise<void> {
    this.isDecoding = true;
    while (this.waiting && !this.isClosed) {
      const { frame, outlines } = this.waiting;
      const { era } = this;
      this.waiting = null;
      if (!frame.surface) break;
      try {
        const surface = await this.source.decode(frame.surface);
        if (this.isClosed) break;
        if (era !== this.era) continue;
        this.frameProblem = '';
        this.scene.show(spaceFrameOf(frame, surface), outlines);
        this.keepInView();
      } catch (error) {
        if (this.isClosed || era !== this.era) continue;
        this.frameProblem = `Frame ${frame.sequence} cannot be shown: ${textOf(error)}`;
        this.scene.show(null, []);
      }
      this.events.shown(frame);
      this.dirty = true;
    }
    this.isDecoding = false;
  }

  private keepInView(): void {
    if (!this.isFree) return;
    const before = viewText(this.scene.view);
    this.scene.fitExtent();
    if (viewText(this.scene.view) !== before) this.events.moved(false);
  }

  private resized(): void {
    this.scene.resize();
    if (this.scene.size.width > 0) this.keepInView();
    this.dirty = true;
  }

  private listen(): void {
    const { canvas } = this;
    const point = (x: number, y: number) => {
      this.pointer = [x, y];
      this.dirty = true;
    };
    canvas.addEventListener('pointermove', (event) => point(event.offsetX, event.offsetY));
    canvas.addEventListener('pointerleave', () => {
      this.pointer = null;
      this.dirty = true;
    });
    canvas.addEventListener('webglcontextrestored', () => { this.dirty = true; });
    canvas.addEventListener('click', (event) => this.selectAtCss(event.offsetX, event.offsetY));
    canvas.addEventListener('keydown', (event) => {
      if (event.key === 'Enter') this.selectAtCss(canvas.clientWidth / 2, canvas.clientHeight / 2);
      if (event.key !== 'Escape') return;
      this.select(null);
      this.events.selected(null);
    });
  }

  private selectAtCss(x: number, y: number): void {
    const picked = this.scene.pick(x, y);
    const identity = picked && (this.scene.frame?.surface.identities[picked.shell] ?? null);
    this.select(identity);
    this.events.selected(identity === null ? null : picked?.point ?? null);
  }

  private axesNow(): AxesDrawing {
    const { extent, camera } = this.scene;
    return this.hasAxes && extent ? axesDrawing(camera, extent) : { lines: [], texts: [] };
  }

  private drawAxes(): void {
    const { lines, texts } = this.axesNow();
    this.axes.replaceChildren(
      ...lines.map(([x1, y1, x2, y2]) => makeSvg('line', { class: 'axis', x1, y1, x2, y2 })),
      ...texts.map(({ x, y, text }) => makeSvg('text', { x, y, 'text-anchor': 'middle' }, text)));
  }

  private updateReadout(): void {
    const lines: string[] = [];
    const picked = this.pointer && !this.isDragging() ? this.scene.pick(...this.pointer) : null;
    if (picked) lines.push(this.pickedText(picked));
    if (this.selected !== null) {
      const shells = this.scene.selectedShells;
      lines.push(`Selected: ${shells.length === 0 ? `body ${this.selected}, not in this frame`
        : shells.map((shell) => this.shellText(shell)).join('\n')}`);
    }
    setText(this.readout, lines.join('\n'));
  }

  private pickedText({ shell, point: [x, y, z] }: PickedShell): string {
    return `x ${number(x)}, y ${number(y)}, z ${number(z)}\n${this.shellText(shell)}`;
  }

  private shellText(shell: number): string {
    const surface = this.scene.frame?.surface;
    if (!surface) return '';
    const { area, volume, particles, parents } = surface.measures;
    const identity = surface.identities[shell];
    const kind = volume[shell] < 0 ? 'cavity' : 'body';
    const former = parents[shell].filter((parent) => parent !== identity);
    return `${identity ? `${kind} ${identity}` : `${kind} without identity`}: area ${number(area[shell])}, ` +
      `volume ${number(Math.abs(volume[shell]))}, particles ${count(particles[shell])}` +
      (former.length > 0 ? `, from ${parents[shell].join(', ')}` : '');
  }
}

function textOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
