import { arrayOf } from '../protocol/arrays';
import { particleBytes } from '../protocol/positions';
import type { Particles } from '../protocol/particles';

/** A uniform hash of `id` in [0, 100) (finaliser of MurmurHash3). */
function percentile(id: number): number {
  let h = id | 0;
  h = Math.imul(h ^ (h >>> 16), 0x85ebca6b);
  h = Math.imul(h ^ (h >>> 13), 0xc2b2ae35);
  return ((h ^ (h >>> 16)) >>> 0) % 100;
}

/** Selects rows of `bytes`. Empty bytes stay empty. */
function rows(bytes: Uint8Array | undefined, rowBytes: number, kept: Uint32Array): Uint8Array {
  if (!bytes || bytes.length === 0) return new Uint8Array(0);
  const out = new Uint8Array(kept.length * rowBytes);
  kept.forEach((row, k) => {
    out.set(bytes.subarray(row * rowBytes, (row + 1) * rowBytes), k * rowBytes);
  });
  return out;
}

/** Selects about `percent` of the particles. The choice depends on ids, or on indices without ids. */
export function shareOf(frame: Particles, percent: number): Particles {
  if (percent >= 100) return frame;
  const rowBytes = particleBytes(frame.positionFormat);
  const count = Math.floor(frame.positions.length / rowBytes);
  const ids = frame.ids && frame.ids.length > 0 ? arrayOf(Uint32Array, frame.ids) : null;
  const kept = new Uint32Array(count);
  let size = 0;
  for (let i = 0; i < count; ++i) {
    const id = ids ? ids[2 * i] ^ ids[2 * i + 1] : i;
    if (percentile(id) < percent) kept[size++] = i;
  }
  return rowsOf(frame, kept.subarray(0, size));
}

/** The particles of some rows. */
export function rowsOf(frame: Particles, chosen: Uint32Array): Particles {
  const rowBytes = particleBytes(frame.positionFormat);
  const count = Math.floor(frame.positions.length / rowBytes);
  const velocityBytes = (frame.velocities?.length ?? 0) / Math.max(1, count);
  return {
    ...frame,
    positions: rows(frame.positions, rowBytes, chosen),
    ids: rows(frame.ids, 8, chosen),
    volumes: rows(frame.volumes, 4, chosen),
    velocities: rows(frame.velocities, velocityBytes, chosen),
    scalars: frame.scalars?.map((scalar) => ({ ...scalar, values: rows(scalar.values, 4 * (scalar.components ?? 1), chosen) })),
  };
}
