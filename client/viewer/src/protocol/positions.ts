import { Plane, PositionFormat } from '@proto/v1/reconstruction_pb';
import { arrayOf } from './arrays';

/** Indices of the two components that span a coordinate plane; x and y if no plane is specified. */
function axesOf(plane: Plane): [number, number] {
  if (plane === Plane.XZ) return [0, 2];
  if (plane === Plane.YZ) return [1, 2];
  return [0, 1];
}

function componentsOf(format: PositionFormat): number {
  return format === PositionFormat.FLOAT32_3 || format === PositionFormat.FLOAT64_3 ? 3 : 2;
}

function numbersOf(format: PositionFormat, bytes: Uint8Array): Float32Array | Float64Array {
  const wide = format === PositionFormat.FLOAT64_2 || format === PositionFormat.FLOAT64_3;
  return wide ? arrayOf(Float64Array, bytes) : arrayOf(Float32Array, bytes);
}

/** Bytes per position. */
export function particleBytes(format: PositionFormat): number {
  const wide = format === PositionFormat.FLOAT64_2 || format === PositionFormat.FLOAT64_3;
  return componentsOf(format) * (wide ? 8 : 4);
}

/** Two coordinates of every particle, relative to `origin`. Positions with x, y, z are projected onto `plane`. */
export function relativePositions(format: PositionFormat, bytes: Uint8Array, plane: Plane,
                                  origin: [number, number]): Float32Array {
  const numbers = numbersOf(format, bytes);
  const components = componentsOf(format);
  const [first, second] = components === 3 ? axesOf(plane) : [0, 1];
  const count = Math.floor(numbers.length / components);
  const points = new Float32Array(2 * count);
  for (let i = 0; i < count; ++i) {
    points[2 * i] = numbers[components * i + first] - origin[0];
    points[2 * i + 1] = numbers[components * i + second] - origin[1];
  }
  return points;
}

/** x, y, z of every particle relative to `origin`; null for positions with two components. */
export function positionsInSpace(format: PositionFormat, bytes: Uint8Array,
                                 origin: readonly [number, number, number]): Float32Array | null {
  if (componentsOf(format) !== 3) return null;
  const numbers = numbersOf(format, bytes);
  const points = new Float32Array(numbers.length - numbers.length % 3);
  for (let i = 0; i < points.length; ++i) points[i] = numbers[i] - origin[i % 3];
  return points;
}
