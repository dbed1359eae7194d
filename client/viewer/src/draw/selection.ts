import type { Frame } from '../protocol/frame';
import { continuations } from './continuation';

/** Largest gap between frames over which a ring is still found by its position. */
const NEAR_FRAMES = 16n;

/** The rings of a frame, or the shells of its surface, for a selection. */
export interface Tracked { sequence: bigint; identities: BigUint64Array; parents: bigint[][] }

/**
 * Follows a selected ring through splits and merges. Each identity that continues the ring counts
 * from the frame in which it took over: after a merge the merged ring, after a split all parts.
 * In earlier frames that identity belonged to another ring. The shells of a surface are followed in the same way.
 */
export class Tracking<F> {
  /** The first frame in which an identity counts. */
  private readonly since = new Map<bigint, bigint>();
  private latest: { frame: F; sequence: bigint; rings: readonly number[] } | null = null;

  /** `byPlace`: finds rings by position that continue the `chosen` ones, if parents are unknown. */
  constructor(private readonly trackedOf: (frame: F) => Tracked,
              private readonly byPlace: (before: F, chosen: readonly number[], after: F) => number[]) {}

  /** Selects one identity. Null and 0 (not tracked) select nothing. */
  start(identity: bigint | null): void {
    this.since.clear();
    this.latest = null;
    if (identity) this.since.set(identity, 0n);
  }

  /** The selected rings of a frame. */
  ringsOf(frame: F): number[] {
    if (this.since.size === 0) return [];
    const { sequence, identities, parents } = this.trackedOf(frame);
    const rings = new Set<number>();
    identities.forEach((identity, ring) => {
      if (this.counts(identity, sequence)) rings.add(ring);
    });
    for (const ring of this.joining(frame, sequence, parents)) {
      rings.add(ring);
      this.add(identities[ring], sequence);
    }
    const selected = [...rings].sort((a, b) => a - b);
    this.latest = { frame, sequence, rings: selected };
    return selected;
  }

  /** Rings that continue selected ones of the latest frame, by parents or else by position. */
  private joining(frame: F, sequence: bigint, parents: bigint[][]): number[] {
    if (!this.latest || this.latest.rings.length === 0) return [];
    const before = this.latest.sequence;
    const passed = sequence - before;
    if (passed === 1n) {
      return [...parents.keys()].filter((ring) => parents[ring].some((parent) => this.counts(parent, before)));
    }
    if (passed < 1n || passed > NEAR_FRAMES) return [];
    return this.byPlace(this.latest.frame, this.latest.rings, frame);
  }

  private add(identity: bigint, sequence: bigint): void {
    if (identity === 0n) return;
    const known = this.since.get(identity);
    if (known === undefined || sequence < known) this.since.set(identity, sequence);
  }

  private counts(identity: bigint, sequence: bigint): boolean {
    const since = this.since.get(identity);
    return since !== undefined && since <= sequence;
  }
}

/** Follows a ring. */
export class Selection extends Tracking<Frame> {
  constructor() {
    super(({ sequence, rings: { identities, parents } }) => ({ sequence, identities, parents }), continuations);
  }
}
