/** Sequences of the first and the last available frame. */
export interface Range { first: number; last: number }

/** `live` follows the newest frame at a fixed latency; `playing` continues from any position. */
export type Mode = 'live' | 'playing' | 'paused';

/** Source of a player. */
export interface Playable {
  range(): Range | null;
  /** Frames per second at speed 1. */
  rate(): number;
  /** The position that follows the newest frame; null without a live stream. */
  livePosition(now: number): number | null;
}

/** The position of a track in time. */
export class Player {
  mode: Mode;
  speed = 1;
  loop = false;
  private position: number | null = null;
  private lastTick: number | null = null;

  constructor(private readonly playable: Playable, private readonly live: boolean) {
    this.mode = live ? 'live' : 'playing';
  }

  /** The sequence to show, which may be missing in the history; null before the first frame. */
  get sequence(): number | null {
    return this.position === null ? null : Math.floor(this.position);
  }

  /** Advances to `now`, in milliseconds. Returns the sequence to show. */
  tick(now: number): number | null {
    const passed = this.lastTick === null ? 0 : Math.max(0, now - this.lastTick);
    this.lastTick = now;
    const range = this.playable.range();
    if (!range) return this.sequence;
    if (this.mode === 'live') this.position = this.playable.livePosition(now) ?? this.position;
    if (this.mode === 'playing') this.advance(range, passed);
    this.position ??= this.mode === 'paused' ? range.first : null;
    return this.sequence;
  }

  /** Pauses at `shown`, the visible frame. If the frame at the position is missing, `shown` is an older one. */
  pause(shown: number | null = this.sequence): void {
    this.position = shown;
    this.mode = 'paused';
  }

  /** Plays from the position; from the start if it is at the end of a file. */
  play(): void {
    const range = this.playable.range();
    if (!this.live && range && this.position !== null && this.position >= range.last) {
      this.position = range.first;
    }
    this.mode = 'playing';
  }

  /** Follows the newest frame of a live stream; plays files. */
  follow(): void {
    this.mode = this.live ? 'live' : 'playing';
  }

  /** Pauses at a frame, or at the nearest available one. */
  seek(sequence: number): void {
    const range = this.playable.range();
    const whole = Math.round(sequence);
    this.position = range ? Math.min(range.last, Math.max(range.first, whole)) : whole;
    this.mode = 'paused';
  }

  /** Starts again: at the newest frame of a live stream, else at the first frame. */
  restart(): void {
    this.position = null;
    this.mode = this.live ? 'live' : 'playing';
  }

  private advance(range: Range, passed: number): void {
    const from = this.position ?? range.first;
    const position = Math.max(range.first, from + this.speed * this.playable.rate() * passed / 1000);
    if (position < range.last + 1) {
      this.position = position;
    } else if (this.live) {
      this.position = range.last;  // Caught up with the newest frame.
      this.mode = 'live';
    } else if (this.loop) {
      this.position = range.first;
    } else {
      this.position = range.last;
      this.mode = 'paused';
    }
  }
}
