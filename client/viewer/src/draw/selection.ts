import type { Frame } from '../protocol/frame';
import { continuations } from './continuation';

/** Largest gap between frames over which a ring is still found by its position. */
const NEAR_FRAMES = 16n;

/**
 * Follows a selected ring through splits and merges. Each identity that continues the ring counts
 * from the frame in which it took over: after a merge the merged ring, after a split all parts.
 * In earlier frames that identity belonged to another ring.
 */
export class Selection {
  /** The first frame in which an identity counts. */
  private readonly since = new Map<bigint, bigint>();
  private latest: { frame: Frame; rings: readonly number[] } | null = null;

  /** Selects one identity. Null and 0 (not tracked) select nothing. */
  start(identity: bigint | null): void {
    this.since.clear();
    this.latest = null;
    if (identity) this.since.set(identity, 0n);
  }

  /** The selected rings of a frame. */
  ringsOf(frame: Frame): number[] {
    if (this.since.size === 0) return [];
    const rings = new Set<number>();
    frame.rings.identities.forEach((identity, ring) => {
      if (this.counts(identity, frame.sequence)) rings.add(ring);
    });
    for (const ring of this.joining(frame)) {
      rings.add(ring);
      this.add(frame.rings.identities[ring], frame.sequence);
    }
    const selected = [...rings].sort((a, b) => a - b);
    this.latest = { frame, rings: selected };
    return selected;
  }

  /** Rings that continue selected ones of the latest frame, by parents or else by position. */
  private joining(frame: Frame): number[] {
    if (!this.latest || this.latest.rings.length === 0) return [];
    const passed = frame.sequence - this.latest.frame.sequence;
    if (passed === 1n) {
      const before = this.latest.frame.sequence;
      return [...frame.rings.parents.keys()].filter((ring) =>
        frame.rings.parents[ring].some((parent) => this.counts(parent, before)));
    }
    if (passed < 1n || passed > NEAR_FRAMES) return [];
    return continuations(this.latest.frame, this.latest.rings, frame);
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
