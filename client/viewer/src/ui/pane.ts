import { attachNavigation, Scene, type Look } from '../draw';
import { boundsOf, fitBounds, type Bounds } from '../draw/view';
import { decodeFrame } from '../protocol/decode';
import type { Frame } from '../protocol/frame';
import { relativePositions } from '../protocol/positions';
import type { Gateway } from '../stream/gateway';
import type { Entry } from '../stream/history';
import { isAsStreamed, settingsText, type Settings } from '../stream/settings';
import type { Track } from '../stream/track';
import { Variant, type VariantResult } from '../stream/variant';
import { make, setText } from './dom';
import { count, number } from './format';
import { Numbers, type Method } from './numbers';

export interface PaneEvents {
  /** The pane is the one that settings and time are for. */
  chosen(pane: Pane): void;
  closed(pane: Pane): void;
  /** The view is another one, by somebody's hand or as the picture has grown. */
  moved(pane: Pane): void;
}

/** One picture: the frame that a track shows, as it was streamed or with settings of its own. */
export class Pane {
  readonly element: HTMLElement;
  readonly scene: Scene;
  frame: Frame | null = null;
  /** The view is the page's own, which keeps everything in it; false once somebody chose one. */
  isFree = true;

  private readonly canvas = make('canvas', {
    tabindex: '0', role: 'application', 'aria-roledescription': 'picture',
  });
  private readonly readout = make('div', { class: 'readout' });
  private readonly name = make('span', { class: 'name' });
  private readonly how = make('span', { class: 'quiet' });
  private readonly closeButton = make('button', { type: 'button', class: 'icon' }, '✕');
  private readonly numbers = new Numbers();
  private readonly variant: Variant;
  private readonly detach: () => void;
  private readonly observer: ResizeObserver;
  private shown: Entry | VariantResult | null = null;
  /** All that was shown since the view was left to the page. */
  private extent: Bounds | null = null;
  private dirty = true;
  private look: Look | null = null;
  private pointer: [number, number] | null = null;
  private selected: bigint | null = null;

  constructor(gateway: Gateway, public track: Track, public settings: Settings,
              private readonly events: PaneEvents) {
    this.element = make('section', { class: 'pane' },
      make('header', {}, this.name, this.how, this.closeButton),
      make('div', { class: 'picture' }, this.canvas, this.readout), this.numbers.element);
    this.variant = new Variant(gateway, () => { this.dirty = true; });
    this.closeButton.addEventListener('click', () => events.closed(this));
    this.element.addEventListener('pointerdown', () => events.chosen(this));
    this.element.addEventListener('focusin', () => events.chosen(this));
    this.scene = new Scene(this.canvas);
    this.detach = attachNavigation(this.canvas, this.scene, () => {
      this.isFree = false;
      this.dirty = true;
      events.moved(this);
    });
    this.listenForRings();
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.canvas);
  }

  /** Which pane of how many this is, for names. */
  setPlace(place: number, of: number, active: boolean): void {
    const label = of > 1 ? `Picture ${place + 1}` : 'Picture';
    this.element.setAttribute('aria-label', label);
    this.element.classList.toggle('active', active);
    this.canvas.setAttribute('aria-label', `${label}: outline of ${this.track.title}`);
    this.closeButton.setAttribute('aria-label', `Close ${label.toLowerCase()}`);
    this.closeButton.hidden = of === 1;
  }

  showTrack(track: Track): void {
    this.track = track;
    this.shown = null;
    this.isFree = true;
    this.extent = null;
    this.variant.reset();
    this.select(null);
  }

  setSettings(settings: Settings): void {
    this.settings = settings;
    this.variant.reset();
    this.shown = null;
  }

  setLook(look: Look): void {
    this.scene.setLook(look);
    const wantsParticles = look.particles && !this.look?.particles;
    this.look = look;
    this.dirty = true;
    if (wantsParticles && this.frame) void this.addParticles(this.frame);
  }

  /** All of the picture, also of what is still to come. */
  fit(): void {
    this.isFree = true;
    this.extent = null;
    this.keepInView();
    this.dirty = true;
  }

  setView(view: Scene['view']): void {
    this.scene.view = { ...view };
    this.isFree = false;
    this.dirty = true;
  }

  /** What speaks against what is shown; empty: nothing. */
  get problem(): string {
    if (this.variant.problem) return this.variant.problem;
    return this.frame?.statistics.doubts.join(' ') ?? '';
  }

  /** Takes over the frame that is due and draws where something has changed. */
  refresh(now: number): void {
    const sequence = this.track.player.sequence;
    if (sequence !== null) this.update(sequence, now);
    setText(this.name, this.track.title);
    setText(this.how, this.description());
    if (!this.dirty) return;
    this.dirty = false;
    this.scene.draw();
    this.updateReadout();
  }

  destroy(): void {
    this.detach();
    this.observer.disconnect();
    this.scene.destroy();
    this.element.remove();
  }

  private get isVariant(): boolean {
    return this.track.kind === 'watch' ? !isAsStreamed(this.settings)
      : !isAsStreamed(this.settings) &&
        settingsText(this.settings) !== settingsText(this.track.settings ?? this.settings);
  }

  private update(sequence: number, now: number): void {
    const entry = this.isVariant ? null : this.track.entryAt(sequence);
    if (entry) {
      if (entry === this.shown) return;
      if (Number.isNaN(entry.summary.latency)) {
        entry.summary.latency = now - entry.receivedAt;
        this.track.counts.drawn++;
      }
      this.show(entry, decodeFrame(entry.parse(), entry.bytes, entry.receivedAt, this.track.plane));
      return;
    }
    const isFailed = this.track.state.kind === 'failed';
    if (!this.isVariant && (this.track.kind === 'watch' || isFailed)) return;
    this.variant.want(this.track, sequence, this.settings);
    const result = this.variant.result;
    if (!result || result === this.shown) return;
    this.show(result, decodeFrame(result.frame, result.bytes, now, this.track.plane));
  }

  private show(what: Entry | VariantResult, frame: Frame): void {
    this.shown = what;
    this.frame = frame;
    this.scene.show(frame);
    this.keepInView();
    this.numbers.show(frame, this.method());
    this.dirty = true;
    if (this.look?.particles) void this.addParticles(frame);
  }

  /** Until somebody chooses a view, the picture grows with what is in it. */
  private keepInView(): void {
    if (!this.isFree || !this.frame) return;
    const bounds = boundsOf(this.frame.rings.points, this.frame.origin);
    if (!bounds) return;
    const extent = this.extent ? union(this.extent, bounds) : bounds;
    if (this.extent && sameBounds(extent, this.extent)) return;
    this.extent = extent;
    this.scene.view = fitBounds(extent, this.scene.size);
    this.events.moved(this);
  }

  /** A producer's own results come without its particles. */
  private async addParticles(frame: Frame): Promise<void> {
    if (frame.particles || this.track.kind !== 'file') return;
    const particles = await this.track.particlesOf(Number(frame.sequence));
    if (!particles || frame !== this.frame) return;
    frame.particles = relativePositions(particles.positionFormat, particles.positions,
                                        this.track.plane, frame.origin);
    this.scene.show(frame);
    this.dirty = true;
  }

  private method(): Method | null {
    const parameters = this.track.parameters;
    if (!parameters) return null;
    return {
      placement: this.settings.placement || parameters.placement,
      fill: this.settings.fill || parameters.fill,
    };
  }

  private description(): string {
    const settings = settingsText(this.settings);
    const words = settings ? settings.replaceAll(';', ', ').replaceAll(':', ' ') : 'as streamed';
    const alone = this.shown !== null && 'frame' in this.shown;
    return alone ? `${words} (this frame by itself)` : words;
  }

  private resize(): void {
    this.scene.resize();
    if (this.isFree && this.extent) {
      this.scene.view = fitBounds(this.extent, this.scene.size);
      this.events.moved(this);
    }
    this.dirty = true;
  }

  private listenForRings(): void {
    this.canvas.addEventListener('pointermove', (event) => this.point(event.offsetX, event.offsetY));
    this.canvas.addEventListener('pointerleave', () => {
      this.pointer = null;
      this.dirty = true;
    });
    this.canvas.addEventListener('click', (event) => {
      this.point(event.offsetX, event.offsetY);
      this.selectAtPointer();
    });
    this.canvas.addEventListener('keydown', (event) => {
      if (event.key === 'Escape') this.select(null);
      if (event.key !== 'Enter') return;
      this.point(this.canvas.clientWidth / 2, this.canvas.clientHeight / 2);
      this.selectAtPointer();
    });
  }

  private point(x: number, y: number): void {
    this.pointer = [x, y];
    this.dirty = true;
  }

  private selectAtPointer(): void {
    if (!this.pointer) return;
    const { ring } = this.scene.pick(...this.pointer);
    const identity = ring === null ? null : this.frame?.rings.identities[ring] ?? null;
    this.select(identity);
  }

  private select(identity: bigint | null): void {
    this.selected = identity;
    this.scene.select(identity);
    this.dirty = true;
  }

  private updateReadout(): void {
    const lines: string[] = [];
    if (this.pointer && this.frame) {
      const { x, y, ring } = this.scene.pick(...this.pointer);
      lines.push(`x ${number(x)}, y ${number(y)}`);
      if (ring !== null) lines.push(this.ringText(ring));
    }
    if (this.selected !== null) {
      const rings = this.scene.selectedRings;
      lines.push(`Selected: ${rings.length === 0 ? `ring ${this.selected}, not in this frame`
        : rings.map((ring) => this.ringText(ring)).join('\n')}`);
    }
    setText(this.readout, lines.join('\n'));
  }

  private ringText(ring: number): string {
    const rings = this.frame?.rings;
    if (!rings) return '';
    const identity = rings.identities[ring];
    const kind = rings.area[ring] < 0 ? 'hole' : 'ring';
    const who = identity ? `${kind} ${identity}` : `${kind} without identity`;
    return `${who}: area ${number(Math.abs(rings.area[ring]))}, perimeter ` +
      `${number(rings.perimeter[ring])}, particles ${count(rings.particles[ring])}`;
  }
}

function union(a: Bounds, b: Bounds): Bounds {
  return {
    left: Math.min(a.left, b.left), bottom: Math.min(a.bottom, b.bottom),
    right: Math.max(a.right, b.right), top: Math.max(a.top, b.top),
  };
}

function sameBounds(a: Bounds, b: Bounds): boolean {
  return a.left === b.left && a.bottom === b.bottom && a.right === b.right && a.top === b.top;
}
