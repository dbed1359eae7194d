import { Output } from '@proto/v1/reconstruction_pb';
import { attachNavigation, Scene, type Legend, type Look, type Picked } from '../draw';
import { valuesAt } from '../draw/values';
import { boundsOf, fitBounds, toCss, union, type Bounds } from '../draw/view';
import type { Drawn } from '../export/canvas_copy';
import type { Mark } from '../export/marks';
import type { Frame } from '../protocol/frame';
import { channelLabel } from '../protocol/channels';
import { type Outline, outlineName, pictureOf } from '../protocol/sections';
import type { SpaceView, Vector } from '../space/camera';
import { DEFAULT_SPACE_LOOK, type SpaceLook } from '../space/look';
import type { SpaceEvents, SpacePicture } from '../space/picture';
import type { Entry, Summary } from '../stream/history';
import {
  cellSizeOf, FILLS, isAsStreamed, nameOf, PLACEMENTS, settingsText, type Settings,
} from '../stream/settings';
import type { CurveSource, Method, Track } from '../stream/track';
import { summaryOf } from '../stream/summary';
import type { Variant } from '../stream/variant';
import type { VariantStream } from '../stream/variant_stream';
import { make, select, setText } from './dom';
import { count, number } from './format';
import { Measurement, type MeasureMode, type Point } from './measure';
import { Numbers } from './numbers';
import { Overlay } from './overlay';
import { paneState, type PaneState, stateName } from './pane_state';
import { ScaleBar } from './scale_bar';

/** Distance of the readout from the pointer, in CSS pixels. */
const POINTER_GAP = 14;

export interface PaneEvents {
  /** The user chose the pane: settings and time apply to it. */
  chosen(pane: Pane): void;
  closed(pane: Pane): void;
  /** The view changed, by the user or because the picture has grown. */
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
  frame: Frame | null = null;
  /** A notice of the page over the picture, or empty. */
  note = '';
  /** Whether the view follows the content. False once the user has moved it. */
  isFree = true;

  private readonly canvas = make('canvas', {
    tabindex: '0', role: 'application', 'aria-roledescription': 'picture',
  });
  private readonly readout = make('div', { class: 'readout' });
  private readonly name = make('span', { class: 'name' });
  private readonly badge = make('span', { class: 'state' });
  private readonly subtitle = make('span', { class: 'quiet' });
  private readonly noticeText = make('span');
  private readonly switchButton = make('button', { type: 'button', title: 'Shows the stream that has this name now.' },
    'Switch to the new run');
  private readonly hideButton = make('button', {
    type: 'button', class: 'icon', 'aria-label': 'Hide notice', title: 'Hides this notice.',
  }, '✕');
  private readonly notice = make('div', { class: 'notice' }, this.noticeText, this.switchButton, this.hideButton);
  /** The notice of the files that the user has hidden. */
  private hiddenNotice = '';
  /** Settings and method of the frame shown. */
  private shownText = '';
  /** Why the frame of the track is refused, or empty. */
  private refusal = '';
  private readonly closeButton = make('button', { type: 'button', class: 'icon', title: 'Closes this picture.' }, '✕');
  private readonly numbers = new Numbers();
  private readonly scaleBar = new ScaleBar();
  private readonly overlay = new Overlay();
  private readonly measurement = new Measurement();
  private readonly variant: Variant | null;
  private stream: VariantStream | null = null;
  private readonly detach: () => void;
  private readonly observer: ResizeObserver;
  private shown: Entry | Frame | null = null;
  /** Bounds of all frames shown since the view follows the content. */
  private extent: Bounds | null = null;
  /** The frame with all its outlines, of which `frame` shows one. */
  private whole: Frame | null = null;
  /** Whether the frame shown still has the former settings. */
  private isPending = false;
  private dirty = true;
  private look: Look | null = null;
  private pointer: [number, number] | null = null;
  private picked: Picked | null = null;
  private selected: bigint | null = null;
  /** The picture of surfaces; null until there is one. */
  private space: SpacePicture | null = null;
  private spaceLook: SpaceLook = DEFAULT_SPACE_LOOK;
  /** The view for the picture of surfaces before there is one. */
  private firstSpaceView: SpaceView | null = null;

  /**
   * `variants`: computes other settings; null if they are not offered. `pictureOfSpace`: makes the
   * picture of surfaces; null where there are none.
   */
  constructor(public track: Track, public settings: Settings, private readonly events: PaneEvents,
              private readonly variants: Variants | null,
              private readonly pictureOfSpace: ((events: SpaceEvents) => SpacePicture) | null = null) {
    this.element = make('section', { class: 'pane' },
      make('header', {}, this.badge, this.name, this.subtitle, this.closeButton),
      make('div', { class: 'picture' }, this.canvas, this.overlay.element, this.scaleBar.element, this.readout, this.notice),
      this.numbers.element);
    this.variant = variants?.frame(() => { this.dirty = true; }) ?? null;
    this.closeButton.addEventListener('click', () => events.closed(this));
    this.hideButton.addEventListener('click', () => { this.hiddenNotice = this.track.notice ?? ''; });
    this.switchButton.addEventListener('click', () => this.track.switchRun?.());
    this.element.addEventListener('pointerdown', () => events.chosen(this));
    this.element.addEventListener('focusin', () => events.chosen(this));
    this.scene = new Scene(this.canvas);
    this.detach = attachNavigation(this.canvas, this.scene, () => {
      this.isFree = false;
      this.dirty = true;
      events.moved(this, true);
    }, track.kind === 'report');
    this.listenForRings();
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.canvas);
  }

  /** Updates names for pane `index` of `count`. */
  setIndex(index: number, count: number, active: boolean): void {
    const label = count > 1 ? `Picture ${index + 1}` : 'Picture';
    this.element.setAttribute('aria-label', label);
    this.element.classList.toggle('active', active);
    this.canvas.setAttribute('aria-label', `${label}: outline of ${this.track.title}`);
    this.space?.canvas.setAttribute('aria-label', `${label}: surface of ${this.track.title}`);
    this.closeButton.setAttribute('aria-label', `Close ${label.toLowerCase()}`);
    this.closeButton.hidden = count === 1;
  }

  showTrack(track: Track): void {
    this.track = track;
    this.clear();
    this.isFree = true;
    this.resetVariant();
    this.select(null);
    this.space?.select(null);
    if (this.space) this.space.isFree = true;
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
    this.space?.setLook(look, this.spaceLook);
    if (isOther && this.whole && this.whole.sections.length > 0) this.showOutline(this.whole);
    if (isNew && this.frame) void this.addParticles(this.frame);
  }

  setSpaceLook(spaceLook: SpaceLook): void {
    this.spaceLook = spaceLook;
    if (this.look) this.space?.setLook(this.look, spaceLook);
  }

  /** Whether the pane shows surfaces in space. */
  get isSpace(): boolean { return this.space !== null && !this.space.element.hidden; }

  /** The canvas of the picture, for exports. */
  get drawn(): Drawn { return this.space && this.isSpace ? this.space.scene : this.scene; }

  get legend(): Legend | null { return this.space && this.isSpace ? this.space.scene.legend() : this.scene.legend(); }

  /** Names of the numbers that the frame can be coloured by. */
  get channels(): string[] { return this.space && this.isSpace ? this.space.scene.channels : this.scene.channels; }

  /** The camera of a picture of surfaces; null for another picture. `isMoved`: whether the user has moved it. */
  get spaceView(): { view: SpaceView; isMoved: boolean } | null {
    return this.space && this.isSpace ? { view: this.space.scene.view, isMoved: !this.space.isFree } : null;
  }

  setSpaceView(view: SpaceView): void {
    if (this.space) this.space.setView(view);
    else this.firstSpaceView = view;
  }

  /** Adopts the view of another pane that shows the same kind of picture. */
  followView(other: Pane): void {
    const { spaceView } = other;
    if (spaceView) this.setSpaceView(spaceView.view);
    else if (!this.isSpace) this.setView(other.scene.view);
  }

  /** What lies over a picture of surfaces, for exports; null for another picture. */
  spaceMarks(dark: boolean): Mark[] | null {
    return this.space && this.isSpace ? this.space.marks(this.caption, dark) : null;
  }

  /** Lets the view follow the content again. */
  fit(): void {
    if (this.isSpace) {
      this.space?.fit();
      return;
    }
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

  /** The outlines of the frame. */
  get outlines(): readonly Outline[] { return this.track.outlines; }

  /** The outline that the pane shows: the first one if the frame lacks the chosen one. */
  private get outlineShown(): number {
    const chosen = this.look?.outlineShown ?? 0;
    return chosen < this.outlines.length ? chosen : 0;
  }

  /** The measurement over the picture, for exports. */
  get measured(): { points: readonly Point[]; text: string } {
    return { points: this.measurement.points, text: this.measurement.text((identity) => this.areaText(identity)) };
  }

  /** Name, frame, time and settings, for exports. */
  get caption(): string {
    if (!this.frame) return this.track.title;
    const label = this.track.labelOf(Number(this.frame.sequence));
    return `${this.track.title}, frame ${label}, time ${number(this.frame.time, 6)}, ${this.shownText}`;
  }

  get state(): PaneState {
    const doubts = this.frame?.statistics.doubts ?? [];
    const problem = this.isSpace ? this.space?.problem ?? '' : '';
    return paneState(this.track, this.refusal || problem, doubts.map((doubt) => this.track.doubtText(doubt)).join(' '),
      this.frame !== null && !this.isPending);
  }

  /** Shows the current frame, and draws if anything has changed. */
  refresh(now: number): void {
    const sequence = this.track.player.sequence;
    // A new run or new settings empty the history. The pane then clears its frame.
    const isStreamed = this.shown !== null && 'summary' in this.shown;
    if (this.stream && !this.stream.isValid) this.resetVariant();
    if (this.frame && isStreamed && this.curves.history.size === 0 && !this.isPending) this.clear();
    if (sequence !== null) this.update(sequence, now);
    setText(this.name, this.track.title);
    setText(this.subtitle, this.frame ? this.shownText : '');
    this.showState();
    if (this.isSpace) {
      this.refreshSpace(now);
      return;
    }
    if (!this.dirty) return;
    this.dirty = false;
    this.pick();
    this.scene.draw();
    this.scaleBar.show(this.scene.view);
    this.overlay.draw(this.scene.view, this.scene.size, this.look?.axes ?? false, this.measurement, this.measured.text);
    this.updateReadout();
  }

  private refreshSpace(now: number): void {
    const drawn = this.space?.refresh() ?? null;
    const entry = drawn && this.track.history.get(Number(drawn.sequence));
    if (entry) this.countDrawn(entry, now);
  }

  destroy(): void {
    this.detach();
    this.resetVariant();
    this.observer.disconnect();
    this.space?.destroy();
    this.scene.destroy();
    this.element.remove();
  }

  /** Shows nothing: the picture of another stream or other settings must not stay under this name. */
  private clear(): void {
    this.shown = null;
    this.whole = null;
    this.frame = null;
    this.extent = null;
    this.refusal = '';
    this.isPending = false;
    this.scene.show(null);
    this.space?.clear();
    this.numbers.clear();
    this.dirty = true;
  }

  private showState(): void {
    const { state } = this;
    this.badge.dataset.state = state.kind;
    setText(this.badge, stateName(state, this.track));
    if (this.badge.title !== state.text) this.badge.title = state.text;
    const isOfFiles = state.kind === 'doubtful' && (this.track.notice ?? '') !== '' && this.track.notice !== this.hiddenNotice;
    const isNoted = this.note !== '' || isOfFiles || this.track.hasNewRun || state.kind === 'lost' || state.kind === 'refused' ||
      (state.kind === 'waiting' && !this.frame);
    this.notice.hidden = !isNoted || this.track.kind === 'report';
    this.switchButton.hidden = !this.track.hasNewRun;
    this.hideButton.hidden = !isOfFiles || this.note !== '';
    if (isNoted) setText(this.noticeText, this.note || (isOfFiles ? this.track.notice ?? '' : state.text));
  }

  private get isVariant(): boolean {
    if (this.hasSurfaces) return false;
    return this.track.kind === 'watch' ? !isAsStreamed(this.settings)
      : !isAsStreamed(this.settings) &&
        settingsText(this.settings) !== settingsText(this.track.settings ?? this.settings);
  }

  /** Shows the frame of the variant's stream. While it is computed, the former one stays. */
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
    stream.drawn(entry, now);
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
      if (!this.isSpace) this.countDrawn(entry, now);
      return;
    }
    const isFailed = this.track.state.kind === 'failed';
    if (!this.variant || this.track.kind === 'watch' || isFailed || !this.track.parameters) return;
    this.variant.request(this.track, sequence, this.settings);
    const { result, problem } = this.variant;
    if (problem && this.frame) this.clear();
    this.refusal = problem;
    if (!result || result === this.shown) return;
    this.show(result, result);
  }

  /** Counts a frame when it is drawn for the first time. A surface is drawn once it is decoded, and space.js loaded. */
  private countDrawn({ summary, receivedAt }: Entry, now: number): void {
    if (!Number.isNaN(summary.latency)) return;
    summary.latency = now - receivedAt;
    this.track.counts.drawn++;
  }

  private show(source: Entry | Frame, frame: Frame): void {
    this.shown = source;
    this.isPending = false;
    this.whole = frame;
    const isSpace = this.pictureOfSpace !== null && frame.surface !== undefined && this.outlineShown === 0;
    this.showSpace(isSpace);
    if (isSpace) {
      this.space?.show(frame, this.outlines);
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
    this.numbers.show(frame, this.track.labelOf(Number(frame.sequence)), this.method());
    this.shownText = this.description();
  }

  /** Switches between the pictures of surfaces and of outlines. */
  private showSpace(isSpace: boolean): void {
    if (isSpace === this.isSpace) return;
    if (isSpace) this.space ??= this.newSpacePicture(this.pictureOfSpace);
    if (this.space) this.space.element.hidden = !isSpace;
    for (const element of [this.canvas, this.overlay.element, this.scaleBar.element, this.readout]) {
      element.toggleAttribute('hidden', isSpace);
    }
    if (!isSpace) this.scene.resize();
  }

  private newSpacePicture(make: Pane['pictureOfSpace']): SpacePicture | null {
    if (!make) return null;
    const space = make({
      moved: (byUser) => this.events.moved(this, byUser),
      selected: (point) => this.events.selected?.(this, point),
      shown: (frame) => { if (this.isSpace) this.showNumbers(frame); },
    });
    space.element.hidden = true;
    space.canvas.setAttribute('aria-label', `Surface of ${this.track.title}`);
    this.canvas.before(space.element);
    if (this.look) space.setLook(this.look, this.spaceLook);
    if (this.firstSpaceView) space.setView(this.firstSpaceView);
    return space;
  }

  /** Shows another outline of the frame, in the coordinates of its plane. */
  private showOutline(whole: Frame): void {
    this.isFree = true;
    this.extent = null;
    this.show(this.shown ?? whole, whole);
  }

  /** While the view follows the content, it grows to include each frame. */
  private keepInView(): void {
    if (!this.isFree || !this.frame) return;
    const bounds = (this.outlineShown === 0 ? this.track.bounds : null) ?? boundsOf(this.frame.rings.points, this.frame.origin);
    if (!bounds) return;
    const extent = this.extent ? union(this.extent, bounds) : bounds;
    if (this.extent && sameBounds(extent, this.extent)) return;
    this.extent = extent;
    this.scene.view = fitBounds(extent, this.scene.size);
    this.events.moved(this, false);
  }

  private async addParticles(frame: Frame): Promise<void> {
    const source = this.stream ?? this.track;
    if (frame.surface || frame.particles || !source.drawnParticles) return;
    const particles = await source.drawnParticles(Number(frame.sequence), frame.origin);
    if (frame !== this.frame || !particles) return;
    frame.particles = particles.points;
    frame.particleAttributes = particles.attributes;
    this.scene.show(frame);
    this.dirty = true;
  }

  private method(): Method | null {
    const { method } = this.track;
    return method && {
      placement: nameOf(PLACEMENTS, this.settings.placement) || method.placement,
      fill: nameOf(FILLS, this.settings.fill) || method.fill,
    };
  }

  private description(): string {
    const settings = settingsText(this.settings);
    const text = settings ? settings.replaceAll(';', ', ').replaceAll(':', ' ') : 'as streamed';
    const isAlone = this.shown !== null && this.shown === this.variant?.result;
    const outline = this.outlines.length > 1
      ? `${outlineName(this.outlines[this.outlineShown])}, ` : '';
    return outline + (isAlone ? `${text} (this frame alone)` : text);
  }

  private resize(): void {
    this.scene.resize();
    if (this.isFree && this.extent) {
      this.scene.view = fitBounds(this.extent, this.scene.size);
      this.events.moved(this, false);
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
      if (event.key === 'Escape') {
        this.measurement.clear();
        this.select(null);
        this.events.selected?.(this, null);
      }
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
    const { x, y, ring } = this.scene.pick(...this.pointer);
    const identity = ring === null ? null : this.frame?.rings.identities[ring] ?? null;
    const mode = select('measure').value as MeasureMode;
    if (mode === 'off') {
      this.select(identity);
      this.events.selected?.(this, identity === null ? null : [x, y]);
    } else {
      this.measurement.add(mode, [x, y], identity);
      this.dirty = true;
    }
  }

  /** Selects the ring or the body at a world position, or none. A picture of the other kind selects nothing. */
  selectAt(point: Point | Vector | null): void {
    if (this.isSpace || point?.length === 3) {
      this.space?.selectAt(point?.length === 3 ? point : null);
      return;
    }
    const ring = point && this.scene.pick(...toCss(this.scene.view, this.scene.size, ...point)).ring;
    this.select(ring === null ? null : this.frame?.rings.identities[ring] ?? null);
  }

  private select(identity: bigint | null): void {
    this.selected = identity || null;
    this.scene.select(identity);
    this.dirty = true;
  }

  private pick(): void {
    this.picked = this.pointer && this.frame ? this.scene.pick(...this.pointer) : null;
    this.scene.hovered = this.picked?.ring ?? null;
  }

  private updateReadout(): void {
    const lines: string[] = [];
    if (this.picked) {
      const { x, y, ring } = this.picked;
      lines.push(`x ${number(x)}, y ${number(y)}`);
      if (ring !== null) lines.push(this.ringText(ring));
      lines.push(...this.valueTexts(x, y));
    }
    if (this.selected !== null) {
      const rings = this.scene.selectedRings;
      lines.push(`Selected: ${rings.length === 0 ? `ring ${this.selected}, not in this frame`
        : rings.map((ring) => this.ringText(ring)).join('\n')}`);
    }
    setText(this.readout, lines.join('\n'));
    this.placeReadout();
  }

  /** Puts the readout beside the pointer, within the picture. Without a pointer it is in the corner. */
  private placeReadout(): void {
    const { style, classList, offsetWidth, offsetHeight } = this.readout;
    const { width, height } = this.scene.size;
    classList.toggle('at-pointer', this.pointer !== null);
    if (!this.pointer) {
      style.left = style.top = '';
      return;
    }
    const [x, y] = this.pointer;
    const beside = (at: number, length: number, room: number) =>
      (at + POINTER_GAP + length <= room ? at + POINTER_GAP : Math.max(0, at - POINTER_GAP - length));
    style.left = `${Math.min(beside(x, offsetWidth, width), Math.max(0, width - offsetWidth))}px`;
    style.top = `${beside(y, offsetHeight, height)}px`;
  }

  /** Attribute values at a world position. */
  private valueTexts(x: number, y: number): string[] {
    const { frame } = this;
    if (!frame) return [];
    const names = this.scene.channels;
    const tolerance = Math.max(frame.statistics.spacing, POINTER_GAP / this.scene.view.scale / 2);
    return valuesAt(frame, names, x - frame.origin[0], y - frame.origin[1], tolerance)
      .map(({ name, value }) => `${channelLabel(name, names)} ${number(value)}`);
  }

  /** Area of a measured ring in the frame shown. */
  private areaText(identity: bigint | null): string {
    if (identity === null) return 'no ring here';
    if (identity === 0n) return 'ring without identity';
    const ring = this.frame?.rings.identities.indexOf(identity) ?? -1;
    if (!this.frame || ring < 0) return `ring ${identity} is not in this frame`;
    const { area, perimeter } = this.frame.rings;
    return `area ${number(Math.abs(area[ring]))}, perimeter ${number(perimeter[ring])}`;
  }

  private ringText(ring: number): string {
    const rings = this.frame?.rings;
    if (!rings) return '';
    const identity = rings.identities[ring];
    const kind = rings.area[ring] < 0 ? 'hole' : 'ring';
    const name = identity ? `${kind} ${identity}` : `${kind} without identity`;
    const parents = rings.parents[ring].filter((parent) => parent !== identity);
    return `${name}: area ${number(Math.abs(rings.area[ring]))}, perimeter ` +
      `${number(rings.perimeter[ring])}, particles ${count(rings.particles[ring])}` +
      (parents.length > 0 ? `, from ${rings.parents[ring].join(', ')}` : '');
  }
}

function sameBounds(a: Bounds, b: Bounds): boolean {
  return a.left === b.left && a.bottom === b.bottom && a.right === b.right && a.top === b.top;
}
