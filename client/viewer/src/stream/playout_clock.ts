// When to draw which frame, so that motion is as smooth as it was when it was sent although frames
// come in bursts: the arrivals of the last frames give a line, sequence over time; what is drawn
// follows this line at a fixed distance.

interface Arrival { sequence: number; at: number }

/** Arrivals that the line is drawn through: about a second of a fast stream. */
const WINDOW = 64;
/** A pause of this many milliseconds, or of this many intervals, begins a new line. */
const LONG_PAUSE_MS = 1000;
const LONG_PAUSE_INTERVALS = 8;
/** Frames a second until two have come. */
const FIRST_RATE = 30;

export class PlayoutClock {
  private arrivals: Arrival[] = [];
  private shown = -Infinity;

  /** `latencyMs`: how far what is drawn lies behind what comes. */
  constructor(readonly latencyMs = 100) {}

  arrived(sequence: number, now: number): void {
    const last = this.arrivals[this.arrivals.length - 1];
    if (last) {
      const pause = now - last.at;
      const longest = Math.max(LONG_PAUSE_MS, LONG_PAUSE_INTERVALS * 1000 / this.rate);
      if (sequence <= last.sequence || pause > longest) this.reset();
    }
    this.arrivals.push({ sequence, at: now });
    if (this.arrivals.length > WINDOW) this.arrivals.shift();
  }

  /** Frames a second. */
  get rate(): number {
    const n = this.arrivals.length;
    if (n < 2) return FIRST_RATE;
    const first = this.arrivals[0];
    const last = this.arrivals[n - 1];
    const seconds = (last.at - first.at) / 1000;
    return seconds > 0 ? (last.sequence - first.sequence) / seconds : FIRST_RATE;
  }

  /** The sequence to draw now, with a fraction; null before any arrival. Never goes back. */
  position(now: number): number | null {
    const n = this.arrivals.length;
    if (n === 0) return null;
    const perMs = this.rate / 1000;
    let sum = 0;
    for (const { sequence, at } of this.arrivals) sum += sequence - perMs * at;
    const line = sum / n + perMs * (now - this.latencyMs);
    const newest = this.arrivals[n - 1].sequence;
    this.shown = Math.min(newest, Math.max(this.shown, line));
    return this.shown;
  }

  reset(): void {
    this.arrivals = [];
    this.shown = -Infinity;
  }
}
