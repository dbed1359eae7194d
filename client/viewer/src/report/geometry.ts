import { bytesOf } from '../protocol/arrays';
import { channelsOf, type Channels } from '../protocol/channels';
import { bareRings, type Mesh, NO_RING, type ParticleSizes, type Rings } from '../protocol/frame';
import { bytesOfBase64, Reader } from './reader';

/** Geometry of a frame in a report. The format is described in client/output/report_geometry.h. */
export interface Geometry {
  origin: [number, number];
  rings: Rings;
  /** Rings of each section, without measures. */
  sections: Rings[];
  mesh: Mesh | null;
  particles: Float32Array;
  particleSizes: ParticleSizes | null;
  particleAttributes: Channels;
}

/** Name of the attribute, and the range of each of its channels. */
export interface Colors { name: string; ranges: readonly (readonly [number, number])[] }

export function decodeGeometry(base64: string, colors: Colors | null): Geometry {
  const reader = new Reader(bytesOfBase64(base64));
  const origin = reader.origin();
  const rings = decodeRings(reader);
  const mesh = decodeMesh(reader, rings.points);
  const particles = reader.points(reader.count());
  const particleSizes = decodeParticleSizes(reader);
  const sections = Array.from({ length: reader.count() }, () => decodeSection(reader));
  const attributes = new Map<string, Float32Array>();
  const particleAttributes = new Map<string, Float32Array>();
  const components = colors && colors.ranges.length > 1 ? colors.ranges.length - 1 : 1;
  const channels = channelsOf(colors?.name ?? '', components);
  for (let channel = 0, count = reader.count(); channel < count; ++channel) {
    const numbers = (shares: Uint8Array) => numbersOf(shares, colors?.ranges[channel] ?? [0, 0]);
    const values = numbers(reader.byteArray());
    const ofParticles = numbers(reader.byteArray());
    attributes.set(channels[channel], values.subarray(0, rings.points.length / 2));
    if (mesh && values.length === mesh.points.length / 2) mesh.attributes.set(channels[channel], values);
    if (ofParticles.length > 0) particleAttributes.set(channels[channel], ofParticles);
  }
  return { origin, rings: { ...rings, attributes }, sections, mesh, particles, particleSizes, particleAttributes };
}

/** Converts bytes to numbers: 0 is the lower end of the range, 255 the upper. */
function numbersOf(shares: Uint8Array, [low, high]: readonly [number, number]): Float32Array {
  return Float32Array.from(shares, (byte) => low + (byte / 255) * (high - low));
}

/** Sizes and nesting of rings. */
function decodeSizes(reader: Reader): { offsets: Uint32Array<ArrayBuffer>; outerOf: Uint32Array<ArrayBuffer> } {
  const count = reader.count();
  const offsets = new Uint32Array(count + 1);
  const outerOf = new Uint32Array(count);
  for (let ring = 0; ring < count; ++ring) {
    offsets[ring + 1] = offsets[ring] + reader.count();
    const outer = reader.count();
    outerOf[ring] = outer === 0 ? NO_RING : outer - 1;
  }
  return { offsets, outerOf };
}

function decodeRings(reader: Reader): Rings {
  const { offsets, outerOf } = decodeSizes(reader);
  const rings = bareRings(reader.points(offsets[outerOf.length]), offsets);
  const turns = reader.byteArray();
  const normals = new Float32Array(2 * turns.length);
  turns.forEach((turn, k) => {
    normals[2 * k] = Math.cos((turn / 128) * Math.PI);
    normals[2 * k + 1] = Math.sin((turn / 128) * Math.PI);
  });
  return { ...rings, outerOf, normals: turns.length > 0 ? normals : null };
}

class ReportMesh implements Mesh {
  readonly attributes = new Map<string, Float32Array>();
  readonly bytes: Mesh['bytes'];

  constructor(readonly points: Float32Array, readonly triangles: Uint32Array,
              readonly classes: Uint8Array) {
    this.bytes = { points: bytesOf(points), triangles: bytesOf(triangles) };
  }

  attribute(name: string): Float32Array | undefined { return this.attributes.get(name); }
}

/** The mesh. Its points begin with the points of the rings, even if no triangle uses these. */
function decodeMesh(reader: Reader, ringPoints: Float32Array): ReportMesh | null {
  const ownPoints = reader.points(reader.count());
  const isShared = reader.count() === 1;
  const count = reader.count();
  const points = new Float32Array(ringPoints.length + ownPoints.length);
  points.set(ringPoints);
  points.set(ownPoints, ringPoints.length);
  const triangles = new Uint32Array(3 * count);
  const classes = new Uint8Array(count);
  let a = isShared ? 0 : ringPoints.length / 2;
  for (let k = 0; k < count; ++k) {
    const packed = reader.signed();
    a += packed >> 1;
    classes[k] = packed & 1;
    triangles[3 * k] = a;
    triangles[3 * k + 1] = a + reader.signed();
    triangles[3 * k + 2] = a + reader.signed();
  }
  return count > 0 ? new ReportMesh(points, triangles, classes) : null;
}

function decodeParticleSizes(reader: Reader): ParticleSizes | null {
  const areDiscs = reader.count() === 1;
  const diameters = Float32Array.from({ length: reader.count() }, () => reader.length());
  return diameters.length > 0 ? { diameters, areDiscs } : null;
}

function decodeSection(reader: Reader): Rings {
  const { offsets, outerOf } = decodeSizes(reader);
  return { ...bareRings(reader.points(offsets[outerOf.length]), offsets), outerOf };
}
