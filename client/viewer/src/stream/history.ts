import type { Frame } from '../protocol/frame';

/** Figures of a frame for the curves. NaN: unknown. */
export interface Summary {
  area: number;
  /** Outer rings, or bodies. */
  rings: number;
  /** Holes, or cavities. */
  holes: number;
  /** Of surfaces only. */
  volume?: number;
  triangles: number;
  trianglesGrid: number;
  milliseconds: number;
  /** Milliseconds, in the order of STAGES. */
  stages: number[];
  /** Counts since the start of the track, at the arrival of the frame. */
  received: number;
  drawn: number;
  dropped: number;
  /** Milliseconds from the arrival of the frame to its first drawing. */
  latency: number;
}

/** A frame in the history. Keeps its message and decodes it on demand. */
export interface Entry {
  readonly sequence: number;
  readonly time: number;
  readonly receivedAt: number;
  /** Size of the message. */
  readonly bytes: number;
  readonly summary: Summary;
  frame(): Frame;
}

/** Approximate size of an entry without its message. */
const ENTRY_BYTES = 600;

/** Frames in the order of their sequence, limited in bytes. */
export class History<E extends Entry = Entry> {
  private entries: E[] = [];
  private heldBytes = 0;

  constructor(private readonly limitBytes: number) {}

  get size(): number { return this.entries.length; }
  get bytes(): number { return this.heldBytes; }
  get first(): E | null { return this.entries[0] ?? null; }
  get last(): E | null { return this.entries[this.entries.length - 1] ?? null; }

  /** The k-th oldest entry. */
  entry(k: number): E { return this.entries[k]; }

  /**
   * Adds an entry, or keeps the existing one of the same sequence. Evicts the oldest entries to stay
   * within the limit, but only entries before `keepFrom` and before the new entry. Returns false if the
   * entry does not fit, and then evicts nothing. An empty history accepts an entry of any size.
   */
  insert(entry: E, keepFrom: number): boolean {
    if (this.get(entry.sequence)) return true;
    const bytes = entry.bytes + ENTRY_BYTES;
    const evictBefore = Math.min(keepFrom, entry.sequence);
    let evicted = 0;
    let left = this.heldBytes;
    while (left + bytes > this.limitBytes && this.entries[evicted]?.sequence < evictBefore) {
      left -= this.entries[evicted++].bytes + ENTRY_BYTES;
    }
    if (left + bytes > this.limitBytes && evicted < this.size) return false;
    this.entries.splice(0, evicted);
    this.entries.splice(this.lowerBound(entry.sequence), 0, entry);
    this.heldBytes = left + bytes;
    return true;
  }

  get(sequence: number): E | null {
    const entry = this.entries[this.lowerBound(sequence)];
    return entry?.sequence === sequence ? entry : null;
  }

  /** The newest entry up to `sequence`. */
  atOrBefore(sequence: number): E | null {
    return this.entries[this.lowerBound(sequence + 1) - 1] ?? null;
  }

  /** The oldest entry after `sequence`. */
  after(sequence: number): E | null {
    return this.entries[this.lowerBound(sequence + 1)] ?? null;
  }

  /** The entry whose time is nearest; the oldest of several. */
  nearestInTime(time: number): E | null {
    let nearest: E | null = null;
    let least = Infinity;
    for (const entry of this.entries) {
      const distance = Math.abs(entry.time - time);
      if (distance < least) [nearest, least] = [entry, distance];
    }
    return nearest;
  }

  clear(): void {
    this.entries = [];
    this.heldBytes = 0;
  }

  /** Index of the first entry from `sequence` on. */
  private lowerBound(sequence: number): number {
    let low = 0;
    let high = this.entries.length;
    if (high > 0 && this.entries[high - 1].sequence < sequence) return high;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.entries[middle].sequence < sequence) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}
