import type { Rings } from '../../protocol/frame';
import type { Look } from '../look';
import { ringColours } from '../look_colours';

/** Marks a vertex whose segment to the next one is not drawn (program.ts, ringAt). */
const CUT = 0x80000000;

/** Numbers per ring: first vertex, end vertex, colour, unused. */
const ROW = 4;

/** Arrays of rings for the shaders, in buffers that are reused from frame to frame. */
export class RingTable {
  private ringOfPoint = new Uint32Array(0);
  private rows = new Uint32Array(0);

  /** The ring of every vertex, and whether its segment is CUT. Valid until the next call. */
  ringOf(rings: Rings): Uint32Array {
    const count = rings.points.length / 2;
    if (this.ringOfPoint.length < count) this.ringOfPoint = new Uint32Array(2 * count);
    const { offsets } = rings;
    for (let ring = 0; ring + 1 < offsets.length; ++ring) {
      this.ringOfPoint.fill(ring, offsets[ring], offsets[ring + 1]);
    }
    for (const point of rings.cuts) this.ringOfPoint[point] |= CUT;
    return this.ringOfPoint.subarray(0, count);
  }

  /** For each ring its first vertex, end vertex and colour, and an unused number. Valid until the next call. */
  styles(rings: Rings, look: Look): Uint32Array {
    const count = rings.offsets.length - 1;
    if (this.rows.length < ROW * count) this.rows = new Uint32Array(2 * ROW * count);
    const colours = ringColours(rings, look);
    for (let ring = 0; ring < count; ++ring) {
      this.rows[ROW * ring] = rings.offsets[ring];
      this.rows[ROW * ring + 1] = rings.offsets[ring + 1];
      this.rows[ROW * ring + 2] = colours(ring);
    }
    return this.rows.subarray(0, ROW * count);
  }
}
