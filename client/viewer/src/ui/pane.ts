import { Output } from '@proto/v1/reconstruction_pb';
import { attachNavigation, Scene, type Legend, type Look } from '../draw';
import { applyKey } from '../draw/navigation';
import { contactMarks } from '../draw/contacts';
import { boundsOf } from '../draw/view';
import type { Drawn } from '../export/canvas_copy';
import type { Mark } from '../export/marks';
import type { Frame } from '../protocol/frame';
import { type Outline, outlineName, pictureOf } from '../protocol/sections';
import type { SpaceView, Vector } from '../space/camera';
import type { SpaceLook } from '../space/look';
import type { SpaceEvents, SpacePicture } from '../space/picture';
import type { Entry, Summary } from '../stream/history';
import { cellSizeOf, isAsStreamed, methodWith, type Settings, settingsPhrase, settingsText } from '../stream/settings';
import type { CurveSource, Track } from '../stream/track';
import { summaryOf } from '../stream/summary';
import type { Variant } from '../stream/variant';
import type { VariantStream } from '../stream/variant_stream';
import { make, setText } from './dom';
import { FollowedView } from './followed_view';
import { number } from './format';
import type { Point } from './measure';
import { Numbers } from './numbers';
import { OutlinePointer } from './outline_pointer';
import { Overlay, type Overlaid } from './overlay';
import { PaneNotice } from './pane_notice';
import { paneState, type PaneState, stateName } from './pane_state';
import { ScaleBar } from './scale_bar';
import { SpaceSlot } from './space_slot';
import type { TextPace } from './text_pace';

export interface PaneEvents {
  /** The user chose the pane: settings and time apply to it. */
  chosen(pane: Pane): void;
  closed(pane: Pane): void;
  /** The view changed: by the user, or to keep the content in view. */
  moved(pane: Pane, byUser: boolean): void;
  /** The user selected the ring or the body at a world position, or none. */
  selected?(pane: Pane, point: Point | Vector | null): void;
}

/** Makes the computations of a pane with other settings than those of its track. */
export interface Variants {
  frame(changed: () => void): Variant;
  stream(track: Track, settings: Settings): VariantStream;
}

/** One picture: the current frame of a track, as streamed or with other settings. */
export class Pane {
  readonly element: HTMLElement;
  readonly scene: Scene;
  readonly numbers = new Numbers();
  frame: Frame | null = null;
  /** A notice of the page over the picture, or empty. */
  note = '';

  private readonly canvas = make('canvas', {
    tabindex: '0', role: 'application', 'aria-roledescription': 'picture',
  });
  private readonly name = make('span', { class: 'name' });
  private readonly badge = make('span', { class: 'state' });
  private readonly subtitle = make('span', { class: 'quiet' });
  private readonly notice = new PaneNotice(() => this.track);
  /** Settings and method of the frame shown. */
  private shownText = '';
  /** Why the frame of the track is refused, or empty. */
  private refusal = '';
  private readonly closeButton = make('button', { type: 'button', class: 'icon', title: 'Closes this picture.' }, '✕');
  private readonly scaleBar = new ScaleBar();
  private readonly overlay = new Overlay();
  private readonly pointer: OutlinePointer;
  private readonly variant: Variant | null;
  private stream: VariantStream | null = null;
  private readonly detach: () => void;
  private readonly observer: ResizeObserver;
  private shown: Entry | Frame | null = null;
  private readonly followed: FollowedView;
  /** The frame with all its outlines, of which `frame` shows one. */
  private whole: Frame | null = null;
  /** Whether the frame shown still has the former settings. */
  private isPending = false;
  private dirty = true;
  private look: Look | null = null;
  private readonly space: SpaceSlot;

  /**
   * `variants`: computes other settings; null if they are not offered. `pictureOfSpace`: makes the
   * picture of surfaces; null if the pane cannot show surfaces.
   */
  constructor(public track: Track, public settings: Settings, private readonly events: PaneEvents,
              private readonly variants: Variants | null,
              pictureOfSpace: ((events: SpaceEvents) => SpacePicture) | null = null) {
    this.variant = variants?.frame(() => { this.dirty = true; }) ?? null;
    this.closeButton.addEventListener('click', () => events.closed(this));
    // Without WebGL, the scene puts its picture after the canvas, which must have a parent.
    const picture = make('div', { class: 'picture' }, this.canvas);
    this.scene = new Scene(this.canvas);
    this.followed = new FollowedView(this.scene, () => events.moved(this, false));
    this.detach = attachNavigation(this.canvas, this.scene, () => {
      this.followed.isFree = false;
      this.dirty = true;
      events.moved(this, true);
    }, track.kind === 'report');
    this.pointer = new OutlinePointer(this.scene, this.canvas, () => this.frame, {
      changed: () => { this.dirty = true; },
      selected: (point) => this.events.selected?.(this, point),
    });
    this.space = new SpaceSlot(pictureOfSpace, {
      moved: (byUser) => events.moved(this, byUser),
      selected: (point) => events.selected?.(this, point),
      shown: (frame) => { if (this.isSpace) this.showNumbers(frame); },
    }, this.canvas);
    picture.append(this.overlay.element, this.scaleBar.element, this.pointer.readout, this.notice.element);
    this.element = make('section', { class: 'pane' },
      make('header', {}, this.badge, this.name, this.subtitle, this.closeButton), picture, this.numbers.element);
    this.element.addEventListener('pointerdown', () => events.chosen(this));
    this.element.addEventListener('focusin', () => events.chosen(this));
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.canvas);
  }

  /** Updates names for pane `index` of `count`. */
  setIndex(index: number, count: number, active: boolean): void {
    const label = count > 1 ? `Picture ${index + 1}` : 'Picture';
    this.element.setAttribute('aria-label', label);
    this.element.classList.toggle('active', active);
    this.canvas.setAttribute('aria-label', `${label}: outline of ${this.track.title}`);
    this.space.picture?.canvas.setAttribute('aria-label', `${label}: surface of ${this.track.title}`);
    this.closeButton.setAttribute('aria-label', `Close ${label.toLowerCase()}`);
    this.closeButton.hidden = count === 1;
  }

  showTrack(track: Track): void {
    this.track = track;
    this.clear();
    this.followed.follow();
    this.resetVariant();
    this.pointer.select(null);
    this.space.picture?.select(null);
    if (this.space.picture) this.space.picture.isFree = true;
    this.showSpace(false);
  }

  setSettings(settings: Settings): void {
    this.settings = settings;
    this.resetVariant();
    this.refusal = '';
    this.isPending = true;
    this.shown = null;
  }

  setLook(look: Look): void {
    this.scene.setLook(look);
    const isNew = look.particles && !this.look?.particles;
    const isOther = look.outlineShown !== this.look?.outlineShown;
    this.look = look;
    this.dirty = true;
    this.space.setLook(look);
    if (isOther && this.whole && this.whole.sections.length > 0) this.showOutline(this.whole);
    if (isNew && this.frame) void this.addParticles(this.frame);
  }

  setSpaceLook(spaceLook: SpaceLook): void { this.space.setSpaceLook(spaceLook); }

  /** Whether the pane shows surfaces in space. */
  get isSpace(): boolean { return this.space.shown !== null; }

  /** The canvas of the picture, for exports. */
  get drawn(): Drawn { return (this.space.shown ?? this).scene; }

  get legend(): Legend | null { return (this.space.shown ?? this).scene.legend(); }

  /** Names of the numbers that the frame can be coloured by. */
  get channels(): string[] { return (this.space.shown ?? this).scene.channels; }

  /** The camera of a picture of surfaces; null for another picture. `isMoved`: whether the user has moved it. */
  get spaceView(): { view: SpaceView; isMoved: boolean } | null {
    const { shown } = this.space;
    return shown && { view: shown.scene.view, isMoved: !shown.isFree };
  }

  setSpaceView(view: SpaceView): void { this.space.setView(view); }

  /** Adopts the view of another pane that shows the same kind of picture. */
  followView(other: Pane): void {
    const { spaceView } = other;
    if (spaceView) this.setSpaceView(spaceView.view);
    else if (!this.isSpace) this.setView(other.scene.view);
  }

  /** Marks of a picture of surfaces, for exports; null for another picture. */
  spaceMarks(dark: boolean): Mark[] | null {
    return this.space.shown?.marks(this.caption, dark) ?? null;
  }

  /** Whether the view follows the content. */
  get isFree(): boolean { return this.followed.isFree; }

  /** Zooms about the middle of the picture by the key + or -. */
  zoom(key: string): void {
    if (this.space.shown) {
      this.space.shown.zoom(key);
      return;
    }
    applyKey(this.scene, key, false);
    this.setView(this.scene.view);
  }

  /** Lets the view follow the content again. */
  fit(): void {
    if (this.space.shown) {
      this.space.shown.fit();
      return;
    }
    this.followed.follow();
    this.keepInView();
    this.dirty = true;
  }

  setView(view: Scene['view']): void {
    this.scene.view = { ...view };
    this.followed.isFree = false;
    this.dirty = true;
  }

  /** The cell size for a number of cells across the longer side of the outline; null without an outline. */
  cellSizeFor(cells: number): number | null {
    const bounds = this.frame && boundsOf(this.frame.rings.points, this.frame.origin);
    const spacing = this.frame?.statistics.spacing ?? 0;
    if (!bounds || !(spacing > 0)) return null;
    return cellSizeOf(cells, Math.max(bounds.right - bounds.left, bounds.top - bounds.bottom), spacing);
  }

  /** The variant's stream, if the pane has other settings than its track. */
  get variantStream(): VariantStream | null { return this.stream; }

  /** The frames of the curves. */
  get curves(): CurveSource { return this.stream ?? this.track; }

  private resetVariant(): void {
    this.variant?.reset();
    this.stream?.close();
    this.stream = null;
  }

  /** Figures of the frame shown; null without one. */
  get summary(): Summary | null {
    if (!this.frame) return null;
    return this.entry?.summary ?? summaryOf(this.frame);
  }

  /** Whether the frame shown is one of the track, and not of other settings or a section. */
  get isStreamed(): boolean { return this.frame === null || this.entry !== null; }

  /** Whether the stream is one of surfaces. */
  get hasSurfaces(): boolean { return this.track.parameters?.output === Output.SURFACE; }

  private get entry(): Entry | null {
    const isOwn = this.frame !== null && (this.frame === this.whole || this.outlineShown === 0);
    return isOwn && this.shown !== null && 'summary' in this.shown ? this.shown : null;
  }

  get outlines(): readonly Outline[] { return this.track.outlines; }

  /** Index of the outline that the pane shows: 0 if the stream lacks the chosen one. */
  private get outlineShown(): number {
    const chosen = this.look?.outlineShown ?? 0;
    return chosen < this.outlines.length ? chosen : 0;
  }

  get overlaid(): Overlaid {
    const { frame, look, scene: { view, size }, pointer: { measurement: { points }, measuredText: text } } = this;
    return { axes: look?.axes ?? false, contacts: frame && look?.outline ? contactMarks(frame, view, size) : [], points, text };
  }

  /** Name, frame, time and settings, for exports. */
  get caption(): string {
    if (!this.frame) return this.track.title;
    const label = this.track.labelOf(Number(this.frame.sequence));
    return `${this.track.title}, frame ${label}, time ${number(this.frame.time, 6)}, ${this.shownText}`;
  }

  get state(): PaneState {
    const doubts = this.frame?.statistics.doubts ?? [];
    const problem = (this.space.shown ?? this.frame)?.problem ?? '';
    return paneState(this.track, this.refusal || problem, doubts.map((doubt) => this.track.doubtText(doubt)).join(' '),
      this.frame !== null && !this.isPending);
  }

  /** Shows the current frame, and draws if anything has changed. */
  refresh(pace: TextPace): void {
    const sequence = this.track.player.sequence;
    // A new run or new settings empty the history. The pane then clears its frame.
    const isStreamed = this.shown !== null && 'summary' in this.shown;
    if (this.stream?.isValid === false) this.resetVariant();
    if (this.frame && isStreamed && this.curves.history.size === 0 && !this.isPending) this.clear();
    if (sequence !== null) this.update(sequence, pace.now);
    this.showState();
    if (pace.isDueFor(this.track) && this.numbers.write()) pace.written();
    if (this.isSpace) return this.refreshSpace();
    if (this.dirty) {
      this.dirty = false;
      this.pointer.pick();
      this.scene.draw();
      this.scaleBar.show(this.scene.view);
      this.overlay.draw(this.scene.view, this.scene.size, this.overlaid);
    }
    this.pointer.updateReadout(pace.isDueFor(this.track));
  }

  private refreshSpace(): void {
    const drawn = this.space.shown?.refresh() ?? null;
    const entry = drawn && this.track.history.get(Number(drawn.sequence));
    if (entry) this.countDrawn(entry);
  }

  destroy(): void {
    this.detach();
    this.resetVariant();
    this.observer.disconnect();
    this.space.picture?.destroy();
    this.scene.destroy();
    this.element.remove();
  }

  /** Shows nothing: the picture of another stream or other settings must not stay under this name. */
  private clear(): void {
    this.shown = null;
    this.whole = null;
    this.frame = null;
    this.followed.restart();
    this.refusal = '';
    this.isPending = false;
    this.scene.show(null);
    this.space.picture?.clear();
    this.numbers.clear();
    this.dirty = true;
  }

  private showState(): void {
    const { state } = this;
    setText(this.name, this.track.title);
    setText(this.subtitle, this.frame ? this.shownText : '');
    this.badge.dataset.state = state.kind;
    setText(this.badge, stateName(state, this.track));
    if (this.badge.title !== state.text) this.badge.title = state.text;
    this.notice.show(state, this.note, this.frame !== null);
  }

  private get isVariant(): boolean {
    const isOther = this.track.kind === 'watch' ||
      settingsText(this.settings) !== settingsText(this.track.settings ?? this.settings);
    return !this.hasSurfaces && isOther && !isAsStreamed(this.settings);
  }

  /** Shows the frame of the variant's stream, or nothing if it is refused. While it is computed, the picture stays. */
  private updateVariant(stream: VariantStream, sequence: number, now: number): void {
    stream.refresh(sequence, now);
    this.refusal = stream.refusalOf(sequence);
    if (this.refusal) {
      const { refusal } = this;
      if (this.frame) this.clear();
      this.refusal = refusal;
      return;
    }
    const entry = stream.entryAt(sequence);
    const isLate = this.track.player.mode === 'paused' && entry?.sequence !== stream.frameAt(sequence);
    this.isPending = !entry || isLate;
    if (!entry || isLate || entry === this.shown) return;
    stream.drawn(entry, performance.now());
    this.show(entry, entry.frame());
  }

  private update(sequence: number, now: number): void {
    if (this.isVariant && this.variants) {
      this.stream ??= this.variants.stream(this.track, this.settings);
      this.updateVariant(this.stream, sequence, now);
      return;
    }
    if (this.stream) this.resetVariant();
    const refusal = this.track.refusalOf?.(sequence) ?? '';
    if (refusal) {
      if (this.frame) this.clear();
      this.refusal = refusal;
      return;
    }
    const entry = this.track.entryAt(sequence);
    if (entry) {
      this.refusal = '';
      if (entry === this.shown) return;
      this.show(entry, entry.frame());
      if (!this.isSpace) this.countDrawn(entry);
      return;
    }
    const { kind, state, parameters } = this.track;
    if (!this.variant || kind === 'watch' || state.kind === 'failed' || !parameters) return;
    this.variant.request(this.track, sequence, this.settings);
    const { result, problem } = this.variant;
    if (problem && this.frame) this.clear();
    this.refusal = problem;
    if (!result || result === this.shown) return;
    this.show(result, result);
  }

  /** Counts a frame at its first drawing. A surface is drawn once it is decoded, and space.js loaded. */
  private countDrawn({ summary, receivedAt }: Entry): void {
    if (!Number.isNaN(summary.latency)) return;
    summary.latency = performance.now() - receivedAt;
    this.track.counts.drawn++;
  }

  private show(source: Entry | Frame, frame: Frame): void {
    this.shown = source;
    this.isPending = false;
    this.whole = frame;
    const isSpace = this.space.isOffered && frame.surface !== undefined && this.outlineShown === 0;
    this.showSpace(isSpace);
    if (isSpace) {
      this.space.picture?.show(frame, this.outlines);
      return;
    }
    frame = pictureOf(frame, this.outlines, this.outlineShown);
    this.frame = frame;
    this.scene.show(frame);
    this.keepInView();
    this.showNumbers(frame);
    this.dirty = true;
    if (this.look?.particles) void this.addParticles(frame);
  }

  private showNumbers(frame: Frame): void {
    this.frame = frame;
    this.numbers.show(frame, this.track.labelOf(Number(frame.sequence)), methodWith(this.track.method, this.settings));
    this.shownText = this.description();
  }

  /** Switches between the pictures of surfaces and of outlines. */
  private showSpace(isSpace: boolean): void {
    if (isSpace === this.isSpace) return;
    this.space.show(isSpace, `Surface of ${this.track.title}`);
    const ofOutlines = [this.canvas, this.overlay.element, this.scaleBar.element, this.pointer.readout];
    for (const element of ofOutlines) element.toggleAttribute('hidden', isSpace);
    (this.space.shown ?? this).scene.resize();
  }

  /** Shows another outline of the frame, in the coordinates of its plane. */
  private showOutline(whole: Frame): void {
    this.followed.follow();
    this.show(this.shown ?? whole, whole);
  }

  /** While the view follows the content, it grows to include each frame. */
  private keepInView(): void {
    if (!this.frame || !this.isFree) return;
    const { rings, origin } = this.frame;
    this.followed.include((this.outlineShown === 0 ? this.track.bounds : null) ?? boundsOf(rings.points, origin));
  }

  private async addParticles(frame: Frame): Promise<void> {
    const source = this.stream ?? this.track;
    if (frame.surface || frame.particles || !source.drawnParticles) return;
    const particles = await source.drawnParticles(Number(frame.sequence), frame.origin);
    if (frame !== this.frame || !particles) return;
    frame.particles = particles.points;
    frame.particleSizes = particles.sizes;
    frame.particleAttributes = particles.attributes;
    this.scene.show(frame);
    this.dirty = true;
  }

  private description(): string {
    const text = settingsPhrase(this.settings);
    const isAlone = this.shown !== null && this.shown === this.variant?.result;
    const outline = this.outlines.length > 1 ? `${outlineName(this.outlines[this.outlineShown])}, ` : '';
    return outline + (isAlone ? `${text} (this frame alone)` : text);
  }

  private resize(): void {
    this.scene.resize();
    this.followed.resize();
    this.dirty = true;
  }

  /** Selects the ring or the body at a world position, or none. A position of the other kind of picture selects none. */
  selectAt(point: Point | Vector | null): void {
    if (this.isSpace || point?.length === 3) {
      this.space.picture?.selectAt(point?.length === 3 ? point : null);
      return;
    }
    this.pointer.selectAt(point);
  }
}
