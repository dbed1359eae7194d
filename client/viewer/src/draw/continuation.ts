import { type Frame, NO_RING, type Rings } from '../protocol/frame';
import { RingIndex } from './pick';

/** Number of vertices of a ring that are compared. */
const SAMPLES = 16;

/**
 * Finds outer rings of a later frame that continue the `chosen` rings of an earlier frame under
 * another identity. Used if frames in between were missed, so that parents are unknown. A vanished
 * ring continues in the ring that covers its position. A new ring continues the ring at whose
 * position it lies. At least half of the SAMPLES vertices compared must lie in the other ring.
 */
export function continuations(before: Frame, chosen: readonly number[], after: Frame): number[] {
  const surviving = new Set(after.rings.identities);
  const vanished = chosen.filter((ring) => isOuter(before.rings, ring) &&
    !surviving.has(before.rings.identities[ring]));
  const known = new Set(before.rings.identities);
  const fresh = [...after.rings.identities.keys()].filter((ring) =>
    isOuter(after.rings, ring) && !known.has(after.rings.identities[ring]));
  const found = new Set<number>();
  if (vanished.length > 0) {
    const index = new RingIndex(after.rings);
    for (const ring of vanished) {
      const cover = ringAround(before, ring, after, index);
      if (cover !== null) found.add(cover);
    }
  }
  if (fresh.length > 0) {
    const index = new RingIndex(before.rings);
    for (const ring of fresh) {
      const origin = ringAround(after, ring, before, index);
      if (origin !== null && chosen.includes(origin)) found.add(ring);
    }
  }
  return [...found];
}

/** The ring of another frame that contains at least half of this ring's samples, or null. */
function ringAround(own: Frame, ring: number, other: Frame, index: RingIndex): number | null {
  const { points, offsets } = own.rings;
  const count = offsets[ring + 1] - offsets[ring];
  const [right, up] = [own.origin[0] - other.origin[0], own.origin[1] - other.origin[1]];
  const votes = new Map<number, number>();
  for (let sample = 0; sample < SAMPLES; ++sample) {
    const k = offsets[ring] + Math.floor((sample * count) / SAMPLES);
    const at = index.ringAt(points[2 * k] + right, points[2 * k + 1] + up, 0);
    if (at === null) continue;
    const votesNow = (votes.get(at) ?? 0) + 1;
    if (votesNow >= SAMPLES / 2) return at;
    votes.set(at, votesNow);
  }
  return null;
}

function isOuter(rings: Rings, ring: number): boolean {
  return rings.outerOf[ring] === NO_RING && rings.identities[ring] !== 0n;
}
