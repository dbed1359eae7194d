import type { ReconstructedFrame } from '@proto/v1/reconstruction_pb';

/** Numbers of a frame for the curves. */
export interface Summary {
  area: number;
  rings: number;
  triangles: number;
  trianglesGrid: number;
  milliseconds: number;
  /** In the order of STAGES. */
  stages: number[];
  /** Counts since the track began, when the frame came. */
  received: number;
  drawn: number;
  dropped: number;
  /** Milliseconds from the frame's coming to its first drawing; NaN until then. */
  latency: number;
}

/** A frame that is kept: its message, which is parsed when it is drawn, and what curves tell. */
export interface Entry {
  readonly sequence: number;
  readonly time: number;
  readonly receivedAt: number;
  readonly bytes: number;
  readonly summary: Summary;
  parse(): ReconstructedFrame;
}

/** What an entry takes beside its message, about. */
const ENTRY_BYTES = 600;

/** Frames by their sequence, bounded in bytes. */
export class History {
  private entries: Entry[] = [];
  private heldBytes = 0;

  constructor(private readonly limitBytes: number) {}

  get size(): number { return this.entries.length; }
  get bytes(): number { return this.heldBytes; }
  get first(): Entry | null { return this.entries[0] ?? null; }
  get last(): Entry | null { return this.entries[this.entries.length - 1] ?? null; }

  /** The k-th of the entries, the oldest is 0. */
  entry(k: number): Entry { return this.entries[k]; }

  /** Keeps an entry. For room the oldest give way, but none from `keepFrom` on: then false, and the
   * entry is not kept. One that is there already stays. */
  insert(entry: Entry, keepFrom: number): boolean {
    if (this.get(entry.sequence)) return true;
    const bytes = entry.bytes + ENTRY_BYTES;
    const mayGo = Math.min(keepFrom, entry.sequence);
    while (this.heldBytes + bytes > this.limitBytes && this.entries[0]?.sequence < mayGo) {
      this.heldBytes -= this.entries[0].bytes + ENTRY_BYTES;
      this.entries.shift();
    }
    if (this.heldBytes + bytes > this.limitBytes && this.size > 0) return false;
    this.entries.splice(this.lowerBound(entry.sequence), 0, entry);
    this.heldBytes += bytes;
    return true;
  }

  get(sequence: number): Entry | null {
    const entry = this.entries[this.lowerBound(sequence)];
    return entry?.sequence === sequence ? entry : null;
  }

  /** The newest entry that is not above `sequence`. */
  atOrBefore(sequence: number): Entry | null {
    return this.entries[this.lowerBound(sequence + 1) - 1] ?? null;
  }

  /** The oldest entry above `sequence`. */
  after(sequence: number): Entry | null {
    return this.entries[this.lowerBound(sequence + 1)] ?? null;
  }

  clear(): void {
    this.entries = [];
    this.heldBytes = 0;
  }

  /** Index of the first entry whose sequence is not below `sequence`. */
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
