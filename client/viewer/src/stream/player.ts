/** Which frames there are. */
export interface Range { first: number; last: number }

/** `live` follows the newest frame at a fixed latency, `playing` goes on from anywhere. */
export type Mode = 'live' | 'playing' | 'paused';

/** What a player plays. */
export interface Playable {
  range(): Range | null;
  /** Frames a second at speed 1. */
  rate(): number;
  /** The place to show where the newest is followed; null where nothing is live. */
  livePosition(now: number): number | null;
}

/** Where in time a track is. */
export class Player {
  mode: Mode;
  speed = 1;
  loop = false;
  private place: number | null = null;
  private lastTick: number | null = null;

  constructor(private readonly playable: Playable, private readonly live: boolean) {
    this.mode = live ? 'live' : 'playing';
  }

  /** The sequence to show, which may be one that is missing; null where there is none yet. */
  get sequence(): number | null {
    return this.place === null ? null : Math.floor(this.place);
  }

  /** Moves on to `now`, in milliseconds. */
  tick(now: number): number | null {
    const passed = this.lastTick === null ? 0 : Math.max(0, now - this.lastTick);
    this.lastTick = now;
    const range = this.playable.range();
    if (!range) return this.sequence;
    if (this.mode === 'live') this.place = this.playable.livePosition(now) ?? this.place;
    if (this.mode === 'playing') this.advance(range, passed);
    this.place ??= this.mode === 'paused' ? range.first : null;
    return this.sequence;
  }

  /** Stands still at `shown`, which is older than the place where frames are missing. */
  pause(shown: number | null = this.sequence): void {
    this.place = shown;
    this.mode = 'paused';
  }

  /** Goes on where it stands; where that is the end of what will not grow, from the beginning. */
  play(): void {
    const range = this.playable.range();
    if (!this.live && range && this.place !== null && this.place >= range.last) {
      this.place = range.first;
    }
    this.mode = 'playing';
  }

  /** To the newest frame, and on with it. */
  follow(): void {
    this.mode = this.live ? 'live' : 'playing';
  }

  /** Stands still at a frame, or at the nearest that there is. */
  seek(sequence: number): void {
    const range = this.playable.range();
    const whole = Math.round(sequence);
    this.place = range ? Math.min(range.last, Math.max(range.first, whole)) : whole;
    this.mode = 'paused';
  }

  /** From the beginning, once there is one. */
  restart(): void {
    this.place = null;
    this.mode = this.live ? 'live' : 'playing';
  }

  private advance(range: Range, passed: number): void {
    const from = this.place ?? range.first;
    const place = Math.max(range.first, from + this.speed * this.playable.rate() * passed / 1000);
    if (place < range.last + 1) {
      this.place = place;
    } else if (this.live) {
      this.place = range.last;  // Caught up: the newest is what comes next.
      this.mode = 'live';
    } else if (this.loop) {
      this.place = range.first;
    } else {
      this.place = range.last;
      this.mode = 'paused';
    }
  }
}
