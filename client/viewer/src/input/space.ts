// 3D particles: defaults of their options, and the particles near a plane.
import { PositionFormat } from '@proto/v1/reconstruction_pb';
import { arrayOf } from '../protocol/arrays';
import type { Particles } from '../protocol/particles';
import { inPlane, type SectionPlane } from '../protocol/sections';
import { extentOf } from './particles';
import { rowsOf } from './share';

const AXES = ['x', 'y', 'z'];
/** Digits of proposed numbers. */
const DIGITS = 4;
/** Number of particles whose neighbours are searched. */
const SAMPLES = 200;
/** Limit of computed distances. It reduces the samples of large frames. */
const MOST_DISTANCES = 4e7;

/** Whether positions have three coordinates. */
export function hasThreeCoordinates(format: PositionFormat): boolean {
  return format === PositionFormat.FLOAT32_3 || format === PositionFormat.FLOAT64_3;
}

/** The coordinates of particles with three of them, by axis. */
export function axesOf({ positionFormat, positions }: Particles): Float64Array[] {
  const numbers = positionFormat === PositionFormat.FLOAT64_3
    ? arrayOf(Float64Array, positions) : arrayOf(Float32Array, positions);
  return AXES.map((_, axis) => Float64Array.from({ length: numbers.length / 3 }, (_, i) => numbers[3 * i + axis]));
}

/** The plane through the middle of the shortest axis, as `z=0.5`. */
export function middlePlane(axes: readonly Float64Array[]): string {
  const extents = axes.map(extentOf);
  const axis = extents.lastIndexOf(Math.min(...extents));
  const low = axes[axis].reduce((least, value) => value < least ? value : least, Infinity);
  const middle = low + extents[axis] / 2;
  const unit = 10 ** (Math.floor(Math.log10(extents[axis])) - DIGITS + 1);
  return `${AXES[axis]}=${Number((Math.round(middle / unit) * unit).toPrecision(12))}`;
}

/** The median distance of a sample of particles to their nearest neighbours, as text; empty if all coincide. */
export function spacingOf([x, y, z]: readonly Float64Array[]): string {
  const count = x.length;
  const samples = Math.max(1, Math.min(SAMPLES, count, Math.floor(MOST_DISTANCES / count)));
  const distances: number[] = [];
  for (let s = 0; s < samples; ++s) {
    const i = Math.floor((s + 0.5) * count / samples);
    let least = Infinity;
    for (let k = 0; k < count; ++k) {
      const square = (x[k] - x[i]) ** 2 + (y[k] - y[i]) ** 2 + (z[k] - z[i]) ** 2;
      if (square < least && square > 0) least = square;
    }
    if (least < Infinity) distances.push(Math.sqrt(least));
  }
  distances.sort((a, b) => a - b);
  return distances.length > 0 ? String(Number(distances[distances.length >> 1].toPrecision(DIGITS))) : '';
}

/** The particles within `distance` of a plane, with their coordinates in the plane. */
export function nearPlane(particles: Particles, plane: SectionPlane, distance: number): Particles {
  const [x, y, z] = axesOf(particles);
  const kept: number[] = [];
  const points: number[] = [];
  for (let i = 0; i < x.length; ++i) {
    const [u, v, height] = inPlane(plane, [x[i], y[i], z[i]]);
    if (Math.abs(height) > distance) continue;
    kept.push(i);
    points.push(u, v);
  }
  const positions = new Uint8Array(Float64Array.from(points).buffer);
  return { ...rowsOf(particles, Uint32Array.from(kept)), positionFormat: PositionFormat.FLOAT64_2, positions };
}
