import type { Look } from '../draw';
import type { Gateway } from '../stream/gateway';
import type { Settings } from '../stream/settings';
import type { Track } from '../stream/track';
import { Variant } from '../stream/variant';
import { VariantStream } from '../stream/variant_stream';
import { byId } from './dom';
import type { Point } from './measure';
import type { Vector } from '../space/camera';
import { DEFAULT_SPACE_LOOK, type SpaceLook } from '../space/look';
import { decoder } from '../space/decoder';
import { loadSpace } from '../space/drawing';
import { SpacePicture, type SpaceSource } from '../space/picture';
import { Pane } from './pane';

/** More pictures would be too small to compare. */
const MOST_PANES = 4;

/** Surfaces are drawn by space.js and decoded by a worker. */
const SPACE_SOURCE: SpaceSource = { load: loadSpace, decode: (message) => decoder.decode(message) };

/** One to four panes side by side. One of them is chosen. */
export class Stage {
  readonly panes: Pane[] = [];
  chosen: Pane | null = null;
  /** Whether panes of different tracks share view and selection. */
  isLinked = true;
  private spaceLook: SpaceLook = DEFAULT_SPACE_LOOK;
  private readonly element = byId('stage', HTMLElement);

  constructor(private readonly gateway: Gateway, private look: Look, private readonly events: {
    chosen(): void;
    moved(pane: Pane): void;
    /** No pane shows the track any more. */
    released(track: Track): void;
  }) {}

  get isFull(): boolean { return this.panes.length >= MOST_PANES; }

  get tracks(): Track[] { return [...new Set(this.panes.map(({ track }) => track))]; }

  add(track: Track, settings: Settings): Pane {
    const pane = new Pane(track, settings, {
      chosen: (chosen) => this.choose(chosen),
      closed: (closed) => this.close(closed),
      moved: (moved, byUser) => this.linkViews(moved, byUser),
      selected: (source, point) => this.linkSelection(source, point),
    }, {
      frame: (changed) => new Variant(this.gateway, changed),
      stream: (of, other) => new VariantStream(this.gateway, of, other),
    }, (events) => new SpacePicture(events, SPACE_SOURCE));
    pane.setLook(this.look);
    pane.setSpaceLook(this.spaceLook);
    this.panes.push(pane);
    this.element.append(pane.element);
    const sibling = this.panes.find((other) => other.track === track && other.frame);
    if (sibling) pane.followView(sibling);
    this.choose(pane);
    return pane;
  }

  close(pane: Pane): void {
    const at = this.panes.indexOf(pane);
    this.panes.splice(at, 1);
    pane.destroy();
    this.release(pane.track);
    this.choose(this.panes[Math.max(0, at - 1)] ?? null);
  }

  /** Replaces the track of a pane. Closes the old track if no other pane shows it. */
  replace(pane: Pane, track: Track): void {
    const old = pane.track;
    pane.showTrack(track);
    this.release(old);
    this.choose(pane);
  }

  choose(pane: Pane | null): void {
    const isOther = pane !== this.chosen;
    this.chosen = pane;
    this.element.dataset.panes = String(this.panes.length);
    byId('welcome', HTMLElement).hidden = this.panes.length > 0;
    this.panes.forEach((one, k) => one.setIndex(k, this.panes.length, one === pane));
    if (isOther) this.events.chosen();
  }

  setLook(look: Look): void {
    this.look = look;
    for (const pane of this.panes) pane.setLook(look);
  }

  setSpaceLook(look: SpaceLook): void {
    this.spaceLook = look;
    for (const pane of this.panes) pane.setSpaceLook(look);
  }

  /** Panes of the same track share their view. Linked panes share it as soon as the user moves one. */
  linkViews(moved: Pane, byUser: boolean): void {
    for (const pane of this.panes) {
      const isShared = pane.track === moved.track || (byUser && this.isLinked);
      if (pane !== moved && isShared) pane.followView(moved);
    }
    this.events.moved(moved);
  }

  /** Linked panes select the ring or the body at the same place. */
  private linkSelection(source: Pane, point: Point | Vector | null): void {
    for (const pane of this.panes) {
      if (pane !== source && this.isLinked) pane.selectAt(point);
    }
  }

  private release(track: Track): void {
    if (this.tracks.includes(track)) return;
    this.events.released(track);
    track.close();
  }
}
