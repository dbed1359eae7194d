import {
  CoordinateFormat, type Mesh as MeshMessage, Output, Plane, PositionFormat, type ReconstructedFrame,
  type Rings as RingsMessage,
} from '@proto/v1/reconstruction_pb';
import { arrayOf, bytesOf } from './arrays';
import { AttributeChannels, type Channels } from './channels';
import type { Frame, Mesh, Rings, Statistics } from './frame';
import { relativePositions } from './positions';
import { surfaceMessageOf } from './surface';

const EMPTY = new Uint8Array(0);

/** Converts float64 world coordinates to float32 relative to their first point. */
class Relative {
  origin: [number, number];

  constructor(private readonly message: ReconstructedFrame) {
    this.origin = [message.originX, message.originY];
    if (!this.isRelative()) this.origin = this.firstPoint();
  }

  points(bytes: Uint8Array): Float32Array {
    if (this.isRelative()) return arrayOf(Float32Array, bytes);
    const world = arrayOf(Float64Array, bytes);
    const points = new Float32Array(world.length);
    const [x, y] = this.origin;
    for (let i = 0; i + 1 < world.length; i += 2) {
      points[i] = world[i] - x;
      points[i + 1] = world[i + 1] - y;
    }
    return points;
  }

  isRelative(): boolean {
    return this.message.coordinateFormat === CoordinateFormat.FLOAT32_RELATIVE;
  }

  private firstPoint(): [number, number] {
    const bytes = this.message.rings?.points ?? this.message.mesh?.points ?? EMPTY;
    const world = arrayOf(Float64Array, bytes.subarray(0, 16));
    return world.length === 2 ? [world[0], world[1]] : [0, 0];
  }
}

/**
 * The mesh of a message. Arrays of a message are rarely aligned, and a copy takes longer than an
 * upload. They are therefore copied when they are first read as numbers.
 */
class MessageMesh implements Mesh {
  readonly classes: Uint8Array;
  readonly bytes: Mesh['bytes'];
  private numbers: Float32Array | null = null;
  private indices: Uint32Array | null = null;
  private readonly channels: Channels;

  constructor(private readonly message: MeshMessage, private readonly relative: Relative) {
    this.classes = message.classes;
    this.channels = new AttributeChannels(message.attributes);
    this.bytes = {
      points: relative.isRelative() ? message.points : bytesOf(this.points),
      triangles: message.triangles,
    };
  }

  get points(): Float32Array {
    return (this.numbers ??= this.relative.points(this.message.points));
  }

  get triangles(): Uint32Array {
    return (this.indices ??= arrayOf(Uint32Array, this.message.triangles));
  }

  attribute(name: string): Float32Array | undefined {
    return this.channels.get(name);
  }
}

function decodeRings(message: RingsMessage | undefined, points: Float32Array): Rings {
  const measures = message?.measures ?? [];
  return {
    points,
    offsets: message ? arrayOf(Uint32Array, message.offsets) : new Uint32Array(1),
    outerOf: arrayOf(Uint32Array, message?.outerOf ?? EMPTY),
    identities: arrayOf(BigUint64Array, message?.identities ?? EMPTY),
    area: Float64Array.from(measures, ({ area }) => area),
    perimeter: Float64Array.from(measures, ({ perimeter }) => perimeter),
    particles: Float64Array.from(measures, ({ particleCount }) => Number(particleCount)),
    parents: measures.map((measure) => measure.parentIdentities),
    normals: message && message.normals.length > 0 ? arrayOf(Float32Array, message.normals) : null,
    attributes: new AttributeChannels(message?.attributes ?? []),
  };
}

function decodeStatistics(message: ReconstructedFrame): Statistics {
  const statistics = message.statistics;
  return {
    particles: Number(statistics?.particles ?? 0),
    triangles: Number(statistics?.triangles ?? 0),
    trianglesGrid: Number(statistics?.trianglesGrid ?? 0),
    area: statistics?.area ?? 0,
    perimeter: statistics?.perimeter ?? 0,
    spacing: statistics?.spacing ?? 0,
    milliseconds: statistics?.milliseconds ?? 0,
    droppedHoles: Number(statistics?.droppedHoles ?? 0),
    droppedComponents: Number(statistics?.droppedComponents ?? 0),
    droppedSpray: Number(statistics?.droppedSpray ?? 0),
    selfIntersections: Number(statistics?.selfIntersections ?? 0),
    foldedTriangles: Number(statistics?.foldedTriangles ?? 0),
    doubts: statistics?.doubts ?? [],
    volume: statistics?.volume ?? 0,
  };
}

/** A section sets neither sequence nor time. */
function decodeSection(section: ReconstructedFrame, { sequence, time }: ReconstructedFrame): Frame {
  return { ...decodeFrame(section, Plane.UNSPECIFIED), sequence, time };
}

/** The server echoes velocities, and no other attributes of the particles. */
function echoedVelocities({ particleFormat, particleVelocities }: ReconstructedFrame): Channels | null {
  if (particleVelocities.length === 0) return null;
  const inSpace = particleFormat === PositionFormat.FLOAT32_3 || particleFormat === PositionFormat.FLOAT64_3;
  return new AttributeChannels([
    { name: 'velocity', values: particleVelocities, components: inSpace ? 3 : 2 },
  ]);
}

/** Decodes a result. `plane`: the plane of echoed particles with three components. */
export function decodeFrame(message: ReconstructedFrame, plane: Plane): Frame {
  const relative = new Relative(message);
  return {
    sequence: message.sequence,
    time: message.time,
    origin: relative.origin,
    rings: decodeRings(message.rings, relative.points(message.rings?.points ?? EMPTY)),
    sections: message.sections.map((section) => decodeSection(section, message)),
    isolines: [],
    mesh: message.mesh ? new MessageMesh(message.mesh, relative) : null,
    particles: message.particles.length > 0
      ? relativePositions(message.particleFormat, message.particles, plane, relative.origin)
      : null,
    particleAttributes: echoedVelocities(message),
    statistics: decodeStatistics(message),
    ringsDigest: message.ringsDigest,
    meshDigest: message.meshDigest,
  };
}

/** Decodes a result of a stream of surfaces, except for the arrays of the surface. */
export function decodeSpaceFrame(message: ReconstructedFrame): Frame {
  const { sequence, time, sections, surfaceDigest, originX, originY } = message;
  return {
    sequence, time, surfaceDigest,
    origin: [originX, originY],
    rings: decodeRings(undefined, new Float32Array(0)),
    sections: sections.map((section) => decodeSection(section, message)),
    isolines: [],
    mesh: null,
    particles: null,
    particleAttributes: echoedVelocities(message),
    statistics: decodeStatistics(message),
    ringsDigest: 0n,
    meshDigest: null,
    surface: surfaceMessageOf(message),
  };
}

/** Decodes a result of a stream with this output. `plane`: as of `decodeFrame`. */
export function decodeResult(message: ReconstructedFrame, output: Output | undefined, plane: Plane): Frame {
  return output === Output.SURFACE ? decodeSpaceFrame(message) : decodeFrame(message, plane);
}
