// Decides when to draw which frame, so that motion is smooth although frames arrive in bursts. The
// clock fits a line to the last arrivals: sequence number over time. The drawn position follows this
// line with a fixed latency.

interface Arrival { sequence: number; at: number }

/** Arrivals in the fit: about a second of a fast stream. */
const WINDOW = 64;
/** A pause above both limits, in milliseconds and in mean intervals between frames, starts a new line. */
const LONG_PAUSE_MS = 1000;
const LONG_PAUSE_INTERVALS = 8;
/** Frames per second before the second arrival. */
const FIRST_RATE = 30;

export class PlayoutClock {
  private arrivals: Arrival[] = [];
  private shown = -Infinity;
  /** The sequence of the last arrival. A new line keeps it. */
  private newest = -Infinity;

  /** `latencyMs`: delay of drawing after arrival. */
  constructor(readonly latencyMs = 100) {}

  arrived(sequence: number, now: number): void {
    if (sequence <= this.newest) this.reset();
    const last = this.arrivals[this.arrivals.length - 1];
    if (last) {
      const pause = now - last.at;
      const longest = Math.max(LONG_PAUSE_MS, LONG_PAUSE_INTERVALS * 1000 / this.rate);
      if (pause > longest) this.arrivals = [];
    }
    this.newest = sequence;
    this.arrivals.push({ sequence, at: now });
    if (this.arrivals.length > WINDOW) this.arrivals.shift();
  }

  /** A frame of the server's history has arrived, and may be drawn at once. `position` then returns no earlier one. */
  passed(sequence: number): void {
    this.shown = Math.max(this.shown, sequence);
    this.newest = Math.max(this.newest, sequence);
  }

  /** Mean frames per second of the arrivals in the fit; FIRST_RATE before the second one. */
  get rate(): number {
    const n = this.arrivals.length;
    if (n < 2) return FIRST_RATE;
    const first = this.arrivals[0];
    const last = this.arrivals[n - 1];
    const seconds = (last.at - first.at) / 1000;
    return seconds > 0 ? (last.sequence - first.sequence) / seconds : FIRST_RATE;
  }

  /**
   * The sequence to draw now, with a fraction; null before any frame. Never decreases until the stream
   * starts again.
   */
  position(now: number): number | null {
    const n = this.arrivals.length;
    if (n === 0) return Number.isFinite(this.shown) ? this.shown : null;
    const perMs = this.rate / 1000;
    let sum = 0;
    for (const { sequence, at } of this.arrivals) sum += sequence - perMs * at;
    const line = sum / n + perMs * (now - this.latencyMs);
    this.shown = Math.min(this.newest, Math.max(this.shown, line));
    return this.shown;
  }

  reset(): void {
    this.arrivals = [];
    this.shown = -Infinity;
    this.newest = -Infinity;
  }
}
