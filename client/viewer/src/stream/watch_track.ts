import {
  WatchMode, type Plane, type ReconstructionParameters, type WatchEnded, type WatchOpened,
  type WatchedFrame,
} from '@proto/v1/reconstruction_pb';
import { Backoff } from './backoff';
import type { Gateway } from './gateway';
import { History, type Entry } from './history';
import { PlayoutClock } from './playout_clock';
import { Player, type Range } from './player';
import type { Particles } from '../protocol/particles';
import { inWords, mayTryAgain, type CallStatus } from './status';
import { summarise, type Counts } from './summary';
import { HISTORY_BYTES, type Track, type TrackState } from './track';
import { WatchCall, parseWatchedFrame } from './watch_call';

/** Between two requests for what is missing: one that brought nothing is not repeated at once. */
const FETCH_PAUSE_MS = 500;

/** A stream that was held back goes on once this share of what is held has been passed. */
const ROOM_SHARE = 0.1;

/** So many have come when the page has surely shown something. */
const FRAMES_OF_THE_BEGINNING = 10;

/** A stream that is watched. Connects again by itself; what it missed and the server still has is
 * fetched: from before its coming, while it was away, and what did not fit while it was paused. */
export class WatchTrack implements Track {
  readonly kind = 'watch';
  readonly history = new History(HISTORY_BYTES);
  readonly player: Player;
  readonly counts: Counts = { received: 0, drawn: 0, dropped: 0 };
  state: TrackState = { kind: 'busy', words: 'Connecting' };
  parameters: ReconstructionParameters | null = null;

  private readonly clock = new PlayoutClock();
  private readonly backoff = new Backoff();
  private call: WatchCall | null = null;
  private backfill: WatchCall | null = null;
  private retry: ReturnType<typeof setTimeout> | null = null;
  private lineage = '';
  /** Up to here frames are history, which comes as fast as it can and says nothing of the pace. */
  private historyEnd = 0;
  /** What the server holds and has made: nothing outside is worth asking for. */
  private serverOldest = Infinity;
  private newest = -Infinity;
  private wasOpen = false;
  private mode = WatchMode.EVERY;
  private isHeldBack = false;
  private pastMissing = false;
  private wanted: number | null = null;
  private nextFetch = 0;

  constructor(private readonly gateway: Gateway, readonly title: string) {
    this.player = new Player(this, true);
    this.connect();
  }

  get plane(): Plane { return this.parameters?.plane ?? 0; }

  range(): Range | null {
    const first = this.history.first;
    return first && { first: first.sequence, last: Math.max(first.sequence, this.newest) };
  }

  rate(): number { return this.clock.rate; }

  livePosition(now: number): number | null {
    return this.clock.position(now) ?? this.history.last?.sequence ?? null;
  }

  entryAt(sequence: number): Entry | null {
    return this.history.atOrBefore(sequence) ?? this.history.first;
  }

  async particlesOf(sequence: number): Promise<Particles | null> {
    const frame = this.entryAt(sequence)?.parse();
    if (!frame || frame.particles.length === 0) return null;
    return { time: frame.time, positionFormat: frame.particleFormat, positions: frame.particles };
  }

  moved(): void {
    this.fetchPast();
    const place = this.player.sequence;
    if (place === null) return;
    const { mode } = this.player;
    if (this.isHeldBack && (mode === 'live' || this.passedShare(place) > ROOM_SHARE)) this.connect();
    if (mode === 'live' || (mode === 'paused' && this.history.get(place))) return;
    const missing = this.missingFrom(place);
    const now = performance.now();
    if (!missing || now < this.nextFetch) return;
    this.nextFetch = now + FETCH_PAUSE_MS;
    this.fetch(missing.first, missing.last);
  }

  /** A frame that somebody wants to see as soon as can be. */
  want(sequence: number): void {
    this.wanted = sequence;
  }

  /** Whether neither the page nor the server has a frame any more. */
  isGone(sequence: number): boolean {
    return this.wasOpen && sequence < this.serverOldest && this.history.get(sequence) === null;
  }

  close(): void {
    this.call?.close();
    this.backfill?.close();
    if (this.retry !== null) clearTimeout(this.retry);
  }

  /** What was before its coming, once the first picture is there; from the wanted frame on first. */
  private fetchPast(): void {
    const first = this.history.first?.sequence;
    if (!this.pastMissing || this.backfill || first === undefined) return;
    // A picture with settings of its own draws none of these frames.
    const hasBegun = this.counts.drawn > 0 || this.counts.received >= FRAMES_OF_THE_BEGINNING;
    if (!hasBegun && this.wanted === null) return;
    const from = Math.max(this.serverOldest, Math.min(this.wanted ?? -Infinity, first - 1));
    this.pastMissing = from > this.serverOldest;
    this.wanted = null;
    if (from < first) this.fetch(from, first - 1);
  }

  /** The gap at or right behind a place, as far as the server can fill it. */
  private missingFrom(place: number): Range | null {
    const entry = this.history.atOrBefore(place);
    const next = this.history.after(place);
    const first = Math.max((entry?.sequence ?? place - 1) + 1, this.serverOldest);
    const last = next ? next.sequence - 1 : this.newest;
    return last >= first ? { first, last } : null;
  }

  /** Of the frames that are held, the share that lies before a place and may go. */
  private passedShare(place: number): number {
    const first = this.history.first?.sequence ?? place;
    const last = this.history.last?.sequence ?? place;
    return last > first ? (place - first) / (last - first) : 0;
  }

  private connect(): void {
    this.isHeldBack = false;
    const last = this.history.last?.sequence;
    const call = new WatchCall(this.gateway, this.title, last === undefined ? null : last + 1, this.mode, {
      opened: (opened) => this.opened(opened),
      frame: (frame, message) => {
        if (!this.take(frame, message, true)) this.holdBack();
      },
      ended: (status, told) => this.ended(status, told),
    });
    this.call = call;
  }

  /** There is no room before the place that is looked at: the rest is for later. */
  private holdBack(): void {
    this.call?.close();
    this.call = null;
    this.isHeldBack = true;
    this.state = {
      kind: 'well', words: 'The page holds as much as it can; the stream goes on without it.',
    };
  }

  private opened(opened: WatchOpened): void {
    if (this.wasOpen && opened.lineage !== this.lineage) this.forget();
    this.wasOpen = true;
    this.lineage = opened.lineage;
    this.parameters = opened.parameters ?? null;
    this.historyEnd = opened.hasFrames ? Number(opened.newestSequence) : 0;
    this.serverOldest = opened.hasFrames ? Number(opened.oldestSequence) : Infinity;
    this.backoff.reset();
    this.state = { kind: 'well', words: 'Live' };
    this.pastMissing = true;
  }

  /** Another stream has taken the name. */
  private forget(): void {
    this.history.clear();
    this.clock.reset();
    this.newest = -Infinity;
    this.backfill?.close();
    this.backfill = null;
    this.player.restart();
  }

  /** Keeps a frame; false where there is no room for it. */
  private take(watched: WatchedFrame, message: Uint8Array, live: boolean): boolean {
    const frame = watched.frame;
    if (!frame) return true;
    const now = performance.now();
    const sequence = Number(frame.sequence);
    if (live) {
      this.counts.received++;
      this.newest = Math.max(this.newest, sequence);
      this.counts.dropped += Number(watched.dropped);
      if (watched.oldestSequence > 0n) this.serverOldest = Number(watched.oldestSequence);
      if (sequence > this.historyEnd) this.clock.arrived(sequence, now);
    }
    const keepFrom = this.player.mode === 'live' ? Infinity : this.player.sequence ?? Infinity;
    return this.history.insert({
      sequence,
      time: frame.time,
      receivedAt: now,
      bytes: message.length,
      summary: summarise(frame, live ? this.counts : null),
      parse: () => parseWatchedFrame(message),
    }, keepFrom);
  }

  private ended(status: CallStatus, told: WatchEnded | null): void {
    this.call = null;
    // Every frame, until it turns out that this is too much.
    if (status.reason === 'FELL_BEHIND') this.mode = WatchMode.LATEST;
    if (!mayTryAgain(status)) {
      this.state = { kind: 'failed', words: inWords(status) };
      return;
    }
    this.state = told && status.code === 0
      ? { kind: 'ended', words: 'The stream has ended. The page waits for it to come back.' }
      : { kind: 'lost', words: `${inWords(status)} Trying again.` };
    this.retry = setTimeout(() => this.connect(), this.backoff.take());
  }

  /** Asks for frames of the server's history, one stretch at a time. */
  private fetch(first: number, last: number): void {
    if (this.backfill) return;
    const done = () => {
      this.backfill?.close();
      this.backfill = null;
    };
    this.backfill = new WatchCall(this.gateway, this.title, first, WatchMode.LATEST, {
      opened: (opened) => { if (opened.lineage !== this.lineage) done(); },
      frame: (frame, message) => {
        const sequence = Number(frame.frame?.sequence ?? 0n);
        const isTaken = sequence <= last && this.take(frame, message, false);
        if (!isTaken || sequence >= last) done();
      },
      ended: () => { this.backfill = null; },
    });
  }
}
