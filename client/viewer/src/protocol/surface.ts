import { CoordinateFormat, type ReconstructedFrame } from '@proto/v1/reconstruction_pb';
import { arrayOf } from './arrays';
import type { NamedValues } from './channels';
import { checkNesting, countCheck, lost as lostField, NO_OUTER, offsetsOf } from './checks';
import { positionsInSpace } from './positions';

// The steps and limits of proto/wire/surface_codec.cc and compact_surface.cc.

/** In Surface.outerOf: an outer shell. */
export const NO_SHELL = NO_OUTER;
/** A shell has at least four triangles, a tetrahedron. */
const FEWEST_OF_SHELL = 4;
const MOST_STEPS = 2 ** 30;
/** The vertex codec stores at least 2 bits for 16 bytes. */
const MOST_EXPANSION = 64;
/** Limit of one array after decompression, in bytes. */
const MOST_BYTES = 1 << 30;
const NORMAL_BYTES = 4;

/** The functions of meshoptimizer that decode compact surfaces. They throw on malformed bytes. */
export interface Codec {
  decodeVertexBuffer(target: Uint8Array, count: number, size: number, source: Uint8Array, filter?: string): void;
  decodeIndexBuffer(target: Uint8Array, count: number, size: number, source: Uint8Array): void;
}

/** Measures of the shells. */
export interface ShellMeasures {
  area: Float64Array;
  /** Negative for a cavity. */
  volume: Float64Array;
  particles: Float64Array;
  /** Identities, in the previous frame, of the shells that each shell continues. */
  parents: bigint[][];
}

/** The bytes of a frame with a surface, to be decoded elsewhere. */
export interface SurfaceMessage {
  format: CoordinateFormat;
  origin: [number, number, number];
  /** False: the frame has no body. */
  hasSurface: boolean;
  points: Uint8Array;
  triangles: Uint8Array;
  pointOffsets: Uint8Array;
  triangleOffsets: Uint8Array;
  outerOf: Uint8Array;
  identities: Uint8Array;
  normals: Uint8Array;
  cuts: Uint8Array;
  attributes: NamedValues[];
  step: number;
  measures: ShellMeasures;
  particleFormat: number;
  particles: Uint8Array;
}

/** Numbers per point: `components` each, interleaved. */
export interface PointValues { name: string; components: number; values: Float32Array }

/** Closed surfaces, ready to draw. A shell is the outside of a body, or a cavity in one. */
export interface Surface {
  /** World coordinates of the point that all positions are relative to. */
  origin: [number, number, number];
  /** x, y, z of each point. */
  positions: Float32Array;
  /** Outward normals, of any length: three floats, or four bytes of which three count. */
  normals: Float32Array | Int8Array;
  /** Three points of each triangle, counter-clockwise seen from outside. */
  triangles: Uint32Array;
  /** Two points of each edge, once. */
  edges: Uint32Array;
  /** Shell k has the points [pointOffsets[k], pointOffsets[k + 1]). */
  pointOffsets: Uint32Array;
  triangleOffsets: Uint32Array;
  /** Outer shell of each cavity; NO_SHELL for an outer shell. */
  outerOf: Uint32Array;
  identities: BigUint64Array;
  measures: ShellMeasures;
  /** Per point: 255 if a triangle on a wall or on a face of the box uses it, otherwise 0. Null if there is no such triangle. */
  inCut: Uint8Array | null;
  /** Smallest x, y, z and largest x, y, z of each shell, relative to the origin. */
  boxes: Float32Array;
  attributes: PointValues[];
  /** x, y, z of each echoed particle, relative to the origin; null without them. */
  particles: Float32Array | null;
}

/** The error for a message that contradicts itself. */
function lost(field: string, rule: string): Error {
  return lostField(`surface.${field}`, rule);
}

/** Sum of the genus of all shells; 0 without a surface. For each shell, points - triangles / 2 = 2 - 2 genus. */
export function genusOf(message: SurfaceMessage | undefined): number {
  const lastOf = (bytes: Uint8Array) => (bytes.length < 4 ? 0 : arrayOf(Uint32Array, bytes.subarray(bytes.length - 4))[0]);
  if (!message) return 0;
  return message.outerOf.length / 4 - (lastOf(message.pointOffsets) - lastOf(message.triangleOffsets) / 2) / 2;
}

/** The bytes of a frame: views into its message. */
export function surfaceMessageOf(message: ReconstructedFrame): SurfaceMessage {
  const { surface } = message;
  const none = new Uint8Array(0);
  const measures = surface?.measures ?? [];
  return {
    format: message.coordinateFormat,
    origin: [message.originX, message.originY, message.originZ],
    hasSurface: surface !== undefined,
    points: surface?.points ?? none,
    triangles: surface?.triangles ?? none,
    pointOffsets: surface?.pointOffsets ?? none,
    triangleOffsets: surface?.triangleOffsets ?? none,
    outerOf: surface?.outerOf ?? none,
    identities: surface?.identities ?? none,
    normals: surface?.normals ?? none,
    cuts: surface?.cuts ?? none,
    attributes: (surface?.attributes ?? []).map(({ name, components, values }) => ({ name, components, values })),
    step: surface?.step ?? 0,
    measures: {
      area: Float64Array.from(measures, ({ area }) => area),
      volume: Float64Array.from(measures, ({ volume }) => volume),
      particles: Float64Array.from(measures, ({ particleCount }) => Number(particleCount)),
      parents: measures.map(({ parentIdentities }) => parentIdentities),
    },
    particleFormat: message.particleFormat,
    particles: message.particles,
  };
}

/** Copies bytes to a new array, because the result is transferred to another thread. */
function copyOf<T extends Uint32Array | Float32Array | BigUint64Array>(
  type: { readonly BYTES_PER_ELEMENT: number; new (buffer: ArrayBufferLike, byteOffset: number, length: number): T },
  bytes: Uint8Array,
): T {
  return arrayOf(type, bytes.slice());
}

function decodeOffsets(bytes: Uint8Array, field: string): Uint32Array {
  return offsetsOf(bytes.slice(), `surface.${field}`, 'shell', FEWEST_OF_SHELL);
}

type Shells = Pick<Surface, 'pointOffsets' | 'triangleOffsets' | 'outerOf' | 'identities'>;

/** Reads offsets and nesting, and checks the sizes of the arrays with an entry for each shell. */
function decodeShells(message: SurfaceMessage): Shells {
  const pointOffsets = decodeOffsets(message.pointOffsets, 'point_offsets');
  const triangleOffsets = decodeOffsets(message.triangleOffsets, 'triangle_offsets');
  const shells = pointOffsets.length - 1;
  const check = countCheck('shell', shells);
  check(triangleOffsets.length === shells + 1, 'surface.triangle_offsets', 'an entry');
  check(message.outerOf.length === 4 * shells, 'surface.outer_of', 'a uint32');
  check([0, 8 * shells].includes(message.identities.length), 'surface.identities', 'a uint64');
  check(message.measures.area.length === shells, 'surface.measures', 'an entry');
  const outerOf = copyOf(Uint32Array, message.outerOf);
  checkNesting(outerOf, 'surface.outer_of', 'shell');
  const identities = message.identities.length > 0
    ? copyOf(BigUint64Array, message.identities) : new BigUint64Array(shells);
  return { pointOffsets, triangleOffsets, outerOf, identities };
}

/** Decompresses an array of `count` entries of `size` bytes. */
function decompress(codec: Codec, bytes: Uint8Array, count: number, size: number, field: string, filter?: string): ArrayBuffer {
  if (count * size / MOST_EXPANSION > bytes.length || count * size > MOST_BYTES) {
    throw lost(field, `has ${bytes.length} bytes, which cannot be ${count} compressed points`);
  }
  const target = new Uint8Array(count * size);
  try {
    codec.decodeVertexBuffer(target, count, size, bytes, filter);
  } catch {
    throw lost(field, `does not decompress to ${count} points`);
  }
  return target.buffer;
}

type Arrays = Pick<Surface, 'origin' | 'positions' | 'triangles' | 'attributes'> & { normals: Surface['normals'] | null };

function checkComponents(message: SurfaceMessage): void {
  message.attributes.forEach(({ components = 0 }, k) => {
    if (components < 1 || components > 3) throw lost(`attributes[${k}]`, 'must have 1 to 3 components');
  });
}

function decodeCompact(message: SurfaceMessage, points: number, triangles: number, codec: Codec): Arrays {
  const { step } = message;
  if (!(step > 0) || !Number.isFinite(step * MOST_STEPS)) throw lost('step', 'is no length');
  const steps = new Int32Array(decompress(codec, message.points, points, 12, 'points'));
  const positions = new Float32Array(steps.length);
  for (let i = 0; i < steps.length; ++i) positions[i] = step * steps[i];
  // The index codec stores at least a byte per triangle.
  if (triangles > message.triangles.length) {
    throw lost('triangles', `has ${message.triangles.length} bytes, too few for ${triangles} triangles`);
  }
  const indices = new Uint32Array(3 * triangles);
  try {
    codec.decodeIndexBuffer(new Uint8Array(indices.buffer), indices.length, 4, message.triangles);
  } catch {
    throw lost('triangles', `does not decompress to ${triangles} triangles`);
  }
  const normals = message.normals.length === 0 ? null
    : new Int8Array(decompress(codec, message.normals, points, NORMAL_BYTES, 'normals', 'OCTAHEDRAL'));
  const attributes = message.attributes.map(({ name, values, components = 1 }, k) => ({
    name, components,
    values: new Float32Array(decompress(codec, values, points, 4 * components, `attributes[${k}]`)),
  }));
  return { origin: message.origin, positions, triangles: indices, normals, attributes };
}

/** Converts world coordinates to float32 relative to the first point. Without points the origin is `other`. */
function relativeToFirst(world: Float64Array, other: [number, number, number]): Pick<Surface, 'origin' | 'positions'> {
  const origin: [number, number, number] = world.length > 0 ? [world[0], world[1], world[2]] : other;
  const positions = new Float32Array(world.length);
  for (let i = 0; i < world.length; ++i) positions[i] = world[i] - origin[i % 3];
  return { origin, positions };
}

function decodePlain(message: SurfaceMessage, points: number, triangles: number): Arrays {
  const isRelative = message.format === CoordinateFormat.FLOAT32_RELATIVE;
  const check = (bytes: Uint8Array, length: number, field: string, rule: string) => {
    if (bytes.length !== length) throw lost(field, rule);
  };
  check(message.points, (isRelative ? 12 : 24) * points, 'points', `must be ${points} points, as the offsets say`);
  check(message.triangles, 12 * triangles, 'triangles', `must have three uint32 for each of the ${triangles} triangles`);
  if (message.normals.length > 0) {
    check(message.normals, 12 * points, 'normals', `must have three floats for each of the ${points} points`);
  }
  const { origin, positions } = isRelative
    ? { origin: message.origin, positions: copyOf(Float32Array, message.points) }
    : relativeToFirst(arrayOf(Float64Array, message.points), message.origin);
  const attributes = message.attributes.map(({ name, values, components = 1 }, k) => {
    check(values, 4 * components * points, `attributes[${k}]`, `must have values for each of the ${points} points`);
    return { name, components, values: copyOf(Float32Array, values) };
  });
  return {
    origin, positions, attributes, triangles: copyOf(Uint32Array, message.triangles),
    normals: message.normals.length > 0 ? copyOf(Float32Array, message.normals) : null,
  };
}

/**
 * Throws unless every shell uses only its own points. Returns the two points of each edge. Two triangles share an edge
 * in opposite directions; the triangle with the ascending direction adds the edge.
 */
function checkTriangles(triangles: Uint32Array, { pointOffsets, triangleOffsets }: Shells): Uint32Array {
  const edges = new Uint32Array(triangles.length);
  let count = 0;
  const add = (a: number, b: number) => {
    if (a >= b || count >= edges.length) return;
    edges[count++] = a;
    edges[count++] = b;
  };
  for (let k = 0; k + 1 < pointOffsets.length; ++k) {
    const [first, end] = [pointOffsets[k], pointOffsets[k + 1]];
    for (let i = 3 * triangleOffsets[k]; i < 3 * triangleOffsets[k + 1]; i += 3) {
      const [a, b, c] = [triangles[i], triangles[i + 1], triangles[i + 2]];
      if (a < first || b < first || c < first || a >= end || b >= end || c >= end) {
        throw lost('triangles', `has a triangle of shell ${k} with the points ${a}, ${b} and ${c}. ` +
          `The shell has the points ${first} to ${end - 1}`);
      }
      add(a, b);
      add(b, c);
      add(c, a);
    }
  }
  return edges.subarray(0, count).slice();
}

/** Marks the points of triangles on walls and on faces of the periodic box. `bytes`: the numbers of these triangles. */
function pointsInCut(bytes: Uint8Array, triangles: Uint32Array, points: number): Uint8Array | null {
  if (bytes.length === 0) return null;
  const cuts = bytes.length % 4 === 0 ? copyOf(Uint32Array, bytes) : null;
  if (!cuts?.every((cut, k) => 3 * cut < triangles.length && (k === 0 || cuts[k - 1] < cut))) {
    throw lost('cuts', `must be ascending numbers of the ${triangles.length / 3} triangles`);
  }
  const inCut = new Uint8Array(points);
  for (const cut of cuts) {
    for (let corner = 3 * cut; corner < 3 * cut + 3; ++corner) inCut[triangles[corner]] = 255;
  }
  return inCut;
}

function boxesOf(positions: Float32Array, offsets: Uint32Array): Float32Array {
  const boxes = new Float32Array(6 * (offsets.length - 1));
  for (let k = 0; k + 1 < offsets.length; ++k) {
    for (let axis = 0; axis < 3; ++axis) {
      let [least, most] = [Infinity, -Infinity];
      for (let i = 3 * offsets[k] + axis; i < 3 * offsets[k + 1]; i += 3) {
        const at = positions[i];
        if (!Number.isFinite(at)) throw lost('points', 'has a coordinate that is not finite');
        if (at < least) least = at;
        if (at > most) most = at;
      }
      boxes[6 * k + axis] = least;
      boxes[6 * k + 3 + axis] = most;
    }
  }
  return boxes;
}

/** Point normals for a surface that has none: the sum of the normals of the triangles at a point, weighted by area. */
function meanNormals(positions: Float32Array, triangles: Uint32Array): Float32Array {
  const normals = new Float32Array(positions.length);
  for (let i = 0; i < triangles.length; i += 3) {
    const [a, b, c] = [3 * triangles[i], 3 * triangles[i + 1], 3 * triangles[i + 2]];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const corner of [a, b, c]) {
      normals[corner] += x;
      normals[corner + 1] += y;
      normals[corner + 2] += z;
    }
  }
  return normals;
}

/** A frame without bodies. */
function emptySurface(origin: [number, number, number]): Omit<Surface, 'particles'> {
  return {
    origin, positions: new Float32Array(0), normals: new Float32Array(0), triangles: new Uint32Array(0),
    edges: new Uint32Array(0), pointOffsets: new Uint32Array(1), triangleOffsets: new Uint32Array(1),
    outerOf: new Uint32Array(0), identities: new BigUint64Array(0), boxes: new Float32Array(0), attributes: [], inCut: null,
    measures: { area: new Float64Array(0), volume: new Float64Array(0), particles: new Float64Array(0), parents: [] },
  };
}

function decodeBodies(message: SurfaceMessage, codec: Codec): Omit<Surface, 'particles'> {
  if (!message.origin.every(Number.isFinite)) throw new Error('The origin has a coordinate that is not finite.');
  if (!message.hasSurface) return emptySurface(message.origin);
  const shells = decodeShells(message);
  const points = shells.pointOffsets[shells.pointOffsets.length - 1];
  const triangles = shells.triangleOffsets[shells.triangleOffsets.length - 1];
  checkComponents(message);
  const arrays = message.format === CoordinateFormat.COMPACT
    ? decodeCompact(message, points, triangles, codec) : decodePlain(message, points, triangles);
  const edges = checkTriangles(arrays.triangles, shells);
  const boxes = boxesOf(arrays.positions, shells.pointOffsets);
  const normals = arrays.normals ?? meanNormals(arrays.positions, arrays.triangles);
  const inCut = pointsInCut(message.cuts, arrays.triangles, points);
  return { ...shells, ...arrays, normals, edges, inCut, boxes, measures: message.measures };
}

/** Decodes a surface and the particles. Throws an Error with a sentence if the message contradicts itself. */
export function decodeSurface(message: SurfaceMessage, codec: Codec): Surface {
  const surface = decodeBodies(message, codec);
  const particles = message.particles.length > 0
    ? positionsInSpace(message.particleFormat, message.particles, surface.origin) : null;
  return { ...surface, particles };
}

/** The buffers to transfer to another thread, each once. Arrays per shell, except `boxes`, are left out and copied. */
export function buffersOf(surface: Surface): ArrayBuffer[] {
  const { positions, normals, triangles, edges, inCut, boxes, attributes, particles } = surface;
  const all = [positions, normals, triangles, edges, inCut, boxes, particles, ...attributes.map(({ values }) => values)];
  return [...new Set(all.flatMap((array) => (array ? [array.buffer as ArrayBuffer] : [])))];
}
