import {
  WatchMode, type ReconstructedFrame, type ReconstructionParameters, type WatchEnded,
  type WatchOpened, type WatchedFrame,
} from '@proto/v1/reconstruction_pb';
import { Backoff } from './backoff';
import type { Gateway } from './gateway';
import { History, type Entry } from './history';
import { PlayoutClock } from './playout_clock';
import { Player, type Range } from './player';
import { decodeResult, echoedParticles } from '../protocol/decode';
import type { Particles } from '../protocol/particles';
import { type Outline, outlinesOf } from '../protocol/sections';
import { methodOf } from './settings';
import { describe, mayRetry, type CallStatus } from './status';
import { summarise, type Counts } from './summary';
import { HISTORY_BYTES, type Method, type Track, type TrackState } from './track';
import { WatchCall, parseWatchedFrame } from './watch_call';

/** Pause between two requests for missing frames. */
const FETCH_PAUSE_MS = 500;

/** A suspended watch resumes once the player has passed this share of the history. */
const RESUME_SHARE = 0.1;

/** Frames after which the page fetches the past even if it has drawn nothing. */
const FRAMES_BEFORE_PAST = 10;

interface WatchEntry extends Entry { message(): ReconstructedFrame }

/** A watched stream. Reconnects by itself, and fetches missed frames that the server still holds:
 * from before the watch, from a lost connection, and from a suspended watch. */
export class WatchTrack implements Track {
  readonly kind = 'watch';
  readonly history = new History<WatchEntry>(HISTORY_BYTES);
  readonly player: Player;
  readonly counts: Counts = { received: 0, drawn: 0, dropped: 0 };
  state: TrackState = { kind: 'busy', text: 'Connecting' };
  parameters: ReconstructionParameters | null = null;

  private readonly clock = new PlayoutClock();
  private readonly backoff = new Backoff();
  private call: WatchCall | null = null;
  private backfill: WatchCall | null = null;
  private retry: ReturnType<typeof setTimeout> | null = null;
  private lineage = '';
  /** Newest frame of the server's history at opening. Frames up to it arrive in a burst, so the clock ignores them. */
  private historyEnd = 0;
  /** Oldest frame that the server holds, and newest frame of the stream. */
  private serverOldest = Infinity;
  private newest = -Infinity;
  private wasOpen = false;
  hasNewRun = false;
  private mode = WatchMode.EVERY;
  private isSuspended = false;
  private isPastMissing = false;
  private requested: number | null = null;
  private nextFetch = 0;
  /** The last message parsed, so that a frame shown soon after its arrival is parsed once. */
  private parsed: { message: Uint8Array; frame: ReconstructedFrame } | null = null;

  constructor(private readonly gateway: Gateway, readonly title: string) {
    this.player = new Player(this, true);
    this.connect();
    this.gateway.info().catch(() => {});  // For `doubtText`. The watch reports errors.
  }

  get method(): Method | null { return methodOf(this.parameters); }
  get bounds(): null { return null; }
  get outlines(): Outline[] { return outlinesOf(this.parameters); }

  range(): Range | null {
    const first = this.history.first;
    return first && { first: first.sequence, last: Math.max(first.sequence, this.newest) };
  }

  rate(): number { return this.clock.rate; }

  livePosition(now: number): number | null {
    return this.clock.position(now) ?? this.history.last?.sequence ?? null;
  }

  entryAt(sequence: number): WatchEntry | null {
    return this.history.atOrBefore(sequence) ?? this.history.first;
  }

  labelOf(sequence: number): string { return String(sequence); }
  sequenceOf(label: number): number { return label; }
  doubtText(doubt: number): string { return this.gateway.doubtText(doubt); }

  async particlesOf(sequence: number): Promise<Particles | null> {
    const frame = this.entryAt(sequence)?.message();
    return frame && frame.particles.length > 0 ? { ...echoedParticles(frame), box: frame.particleBox } : null;
  }

  refresh(): void {
    if (this.hasNewRun) return;  // The server holds frames of the new run only.
    this.fetchPast();
    const position = this.player.sequence;
    if (position === null) return;
    const { mode } = this.player;
    if (this.isSuspended && (mode === 'live' || this.passedShare(position) > RESUME_SHARE)) this.connect();
    if (mode === 'live' || (mode === 'paused' && this.history.get(position))) return;
    const missing = this.missingFrom(position);
    const now = performance.now();
    if (!missing || now < this.nextFetch) return;
    this.nextFetch = now + FETCH_PAUSE_MS;
    this.fetch(missing.first, missing.last);
  }

  /** Fetches this frame of the past before others. */
  request(sequence: number): void {
    this.requested = sequence;
  }

  /** Whether neither the page nor the server holds a frame. */
  isGone(sequence: number): boolean {
    // An open stream without frames has no oldest frame: nothing of it is gone.
    return Number.isFinite(this.serverOldest) && sequence < this.serverOldest && this.history.get(sequence) === null;
  }

  close(): void {
    this.call?.close();
    this.backfill?.close();
    if (this.retry !== null) clearTimeout(this.retry);
  }

  /**
   * Fetches the frames from before the watch that the server holds. Fetches a requested frame, and
   * the frames after it, at once; a later call fetches the older frames. If no frame is requested,
   * waits for the first picture.
   */
  private fetchPast(): void {
    const first = this.history.first?.sequence;
    if (!this.isPastMissing || this.backfill || first === undefined) return;
    // A pane with other settings draws none of these frames, so received frames count too.
    const hasStarted = this.counts.drawn > 0 || this.counts.received >= FRAMES_BEFORE_PAST;
    if (!hasStarted && this.requested === null) return;
    const from = Math.max(this.serverOldest, Math.min(this.requested ?? -Infinity, first - 1));
    this.isPastMissing = from > this.serverOldest;
    this.requested = null;
    if (from < first) this.fetch(from, first - 1);
  }

  /** The gap at or after a position, as far as the server can fill it. */
  private missingFrom(position: number): Range | null {
    const entry = this.history.atOrBefore(position);
    const next = this.history.after(position);
    const first = Math.max((entry?.sequence ?? position - 1) + 1, this.serverOldest);
    const last = next ? next.sequence - 1 : this.newest;
    return last >= first ? { first, last } : null;
  }

  /** Share of the history that lies before a position, so that it may be evicted. */
  private passedShare(position: number): number {
    const first = this.history.first?.sequence ?? position;
    const last = this.history.last?.sequence ?? position;
    return last > first ? (position - first) / (last - first) : 0;
  }

  private connect(): void {
    this.isSuspended = false;
    const last = this.history.last?.sequence;
    const call = new WatchCall(this.gateway, this.title, last === undefined ? null : last + 1, this.mode, {
      opened: (opened) => this.opened(opened),
      frame: (frame, message) => {
        if (!this.take(frame, message, true)) this.suspend();
      },
      ended: (status, end) => this.ended(status, end),
    });
    this.call = call;
  }

  /** Ends the call: the history is full from the player's position on. Later frames are fetched when there is room. */
  private suspend(): void {
    this.call?.close();
    this.call = null;
    this.isSuspended = true;
    this.state = {
      kind: 'well', text: 'The history is full. The page fetches later frames when you move forward.',
    };
  }

  private opened(opened: WatchOpened): void {
    if (this.wasOpen && opened.lineage !== this.lineage) {
      if (this.history.size > 0) {
        this.keepFormerRun();
        return;
      }
      this.forget();
    }
    this.wasOpen = true;
    this.lineage = opened.lineage;
    this.parameters = opened.parameters ?? null;
    this.historyEnd = opened.hasFrames ? Number(opened.newestSequence) : 0;
    this.serverOldest = opened.hasFrames ? Number(opened.oldestSequence) : Infinity;
    this.backoff.reset();
    this.state = { kind: 'well', text: 'Live' };
    this.isPastMissing = true;
  }

  switchRun(): void {
    this.close();
    this.hasNewRun = false;
    this.forget();
    this.lineage = '';
    this.wasOpen = false;
    this.state = { kind: 'busy', text: 'Connecting' };
    this.connect();
  }

  /** Another stream has the name now. The frames of the former one stay until `switchRun`. */
  private keepFormerRun(): void {
    this.close();
    this.call = null;
    this.backfill = null;
    this.hasNewRun = true;
    this.state = { kind: 'ended', text: 'This run has ended. A new run with the same name has started.' };
  }

  private forget(): void {
    this.history.clear();
    this.parsed = null;
    this.clock.reset();
    this.newest = -Infinity;
    this.backfill?.close();
    this.backfill = null;
    this.player.restart();
  }

  /** Adds a frame to the history. Returns false if it does not fit. */
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
      else this.clock.passed(sequence);
    }
    const keepFrom = this.player.mode === 'live' ? Infinity : this.player.sequence ?? Infinity;
    const parse = () => this.frameOf(message);
    const isKept = this.history.insert({
      sequence,
      time: frame.time,
      receivedAt: now,
      bytes: message.length,
      summary: summarise(frame, live ? this.counts : null),
      message: parse,
      frame: () => decodeResult(parse(), this.parameters),
    }, keepFrom);
    if (isKept && live) this.parsed = { message, frame };
    return isKept;
  }

  private frameOf(message: Uint8Array): ReconstructedFrame {
    if (this.parsed?.message !== message) this.parsed = { message, frame: parseWatchedFrame(message) };
    return this.parsed.frame;
  }

  private ended(status: CallStatus, end: WatchEnded | null): void {
    this.call = null;
    // The page requests every frame until the server has disconnected it as too slow. Then it requests
    // the newest frames only.
    if (status.reason === 'FELL_BEHIND') this.mode = WatchMode.LATEST;
    if (!mayRetry(status)) {
      this.state = { kind: 'failed', text: describe(status) };
      return;
    }
    if (status.reason === 'NO_SUCH_STREAM' || (end && status.code === 0)) {
      this.state = this.wasOpen
        ? { kind: 'ended', text: 'The stream has ended. Waiting for it to start again.' }
        : { kind: 'busy', text: `${describe(status)} Waiting for it.` };
    } else {
      this.state = { kind: 'lost', text: `${describe(status)} Trying again.` };
    }
    this.retry = setTimeout(() => this.connect(), this.backoff.take());
  }

  /** Fetches frames from the server's history, one range at a time. */
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
