// Messages of surfaces for tests, in the layout of the C++ program.
import { CoordinateFormat } from '@proto/v1/reconstruction_pb';
import { bytesOf } from '../src/protocol/arrays';
import { NO_SHELL, type SurfaceMessage } from '../src/protocol/surface';

/** Corners of an octahedron around a centre, x, y, z each; and its triangles, counter-clockwise seen from outside. */
export function octahedron([x, y, z]: readonly number[], radius: number): { points: number[]; triangles: number[] } {
  const r = radius;
  return {
    points: [x + r, y, z, x - r, y, z, x, y + r, z, x, y - r, z, x, y, z + r, x, y, z - r],
    triangles: [0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5],
  };
}

const SPACE = { FLOAT64: CoordinateFormat.FLOAT64, FLOAT32: CoordinateFormat.FLOAT32_RELATIVE };

/** Octahedra of radius 1 as bodies with the identities 1, 2, ... in an uncompressed message. */
export function plainMessage(centres: readonly (readonly number[])[], format: keyof typeof SPACE = 'FLOAT64'): SurfaceMessage {
  const shells = centres.map((centre) => octahedron(centre, 1));
  const points = shells.flatMap((shell) => shell.points);
  const origin: [number, number, number] = format === 'FLOAT64' ? [0, 0, 0] : [10, 20, 30];
  const relative = points.map((value, i) => value - origin[i % 3]);
  const empty = new Uint8Array(0);
  return {
    format: SPACE[format], origin, hasSurface: true, step: 0,
    points: bytesOf(format === 'FLOAT64' ? Float64Array.from(relative) : Float32Array.from(relative)),
    triangles: bytesOf(Uint32Array.from(shells.flatMap(({ triangles }, k) => triangles.map((corner) => corner + 6 * k)))),
    pointOffsets: bytesOf(Uint32Array.from([...shells, null], (_, k) => 6 * k)),
    triangleOffsets: bytesOf(Uint32Array.from([...shells, null], (_, k) => 8 * k)),
    outerOf: bytesOf(Uint32Array.from(shells, () => NO_SHELL)),
    identities: bytesOf(BigUint64Array.from(shells, (_, k) => BigInt(k + 1))),
    normals: empty, cuts: empty,
    attributes: [{ name: 'p', components: 1, values: bytesOf(Float32Array.from({ length: points.length / 3 }, (_, k) => k)) }],
    measures: {
      area: Float64Array.from(shells, () => 4 * Math.sqrt(3)), volume: Float64Array.from(shells, () => 4 / 3),
      particles: Float64Array.from(shells, () => 8), parents: shells.map(() => []),
    },
    particleFormat: 0, particles: empty,
  };
}
