import {
  CoordinateFormat, Doubt, type Mesh as MeshMessage, Plane, type ReconstructedFrame, type Rings as RingsMessage,
} from '@proto/v1/reconstruction_pb';
import { arrayOf, bytesOf } from './arrays';
import type { Frame, Mesh, Rings, Statistics } from './frame';
import { relativePositions } from './positions';

const EMPTY = new Uint8Array(0);

const DOUBTS: Record<number, string> = {
  [Doubt.SPACING_PROVISIONAL]:
    'The spacing is a guess of this frame alone. Give the spacing.',
  [Doubt.SPACING_CONTRADICTED]:
    'The particles are more than twice as near or as far from each other as the spacing says. ' +
    'Give the right spacing; look at the units.',
  [Doubt.VOLUMES_CONTRADICT_SPACING]:
    "Most volumes do not fit the spacing. Send areas, in the square of the positions' unit.",
  [Doubt.POSITIONS_COARSE]:
    'float32 is coarse at these coordinates. Send float64, or coordinates near the origin.',
};

/** float64 world coordinates as float32 relative to their first point. */
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
 * The mesh of a message. A message's arrays are rarely aligned, and copying them takes longer than
 * to upload them: they are copied when somebody reads them as numbers.
 */
class MessageMesh implements Mesh {
  readonly classes: Uint8Array;
  readonly bytes: Mesh['bytes'];
  private numbers: Float32Array | null = null;
  private indices: Uint32Array | null = null;

  constructor(private readonly message: MeshMessage, private readonly relative: Relative) {
    this.classes = message.classes;
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
}

function decodeRings(message: RingsMessage | undefined, points: Float32Array): Rings {
  const measures = message?.measures ?? [];
  const count = measures.length;
  const rings: Rings = {
    points,
    offsets: message ? arrayOf(Uint32Array, message.offsets) : new Uint32Array(1),
    outerOf: arrayOf(Uint32Array, message?.outerOf ?? EMPTY),
    identities: arrayOf(BigUint64Array, message?.identities ?? EMPTY),
    area: new Float64Array(count),
    perimeter: new Float64Array(count),
    particles: new Float64Array(count),
    parents: measures.map((measure) => measure.parentIdentities),
    normals: message && message.normals.length > 0 ? arrayOf(Float32Array, message.normals) : null,
    attributes: new Map(),
  };
  measures.forEach((measure, k) => {
    rings.area[k] = measure.area;
    rings.perimeter[k] = measure.perimeter;
    rings.particles[k] = Number(measure.particleCount);
  });
  for (const attribute of message?.attributes ?? []) {
    rings.attributes.set(attribute.name, arrayOf(Float32Array, attribute.values));
  }
  return rings;
}

function decodeMesh(message: ReconstructedFrame, relative: Relative): Mesh | null {
  const mesh = message.mesh;
  if (!mesh) return null;
  return new MessageMesh(mesh, relative);
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
    cellSize: statistics?.cellSize ?? 0,
    milliseconds: statistics?.milliseconds ?? 0,
    stages: (statistics?.stages ?? []).map(({ stage, milliseconds }) => ({ stage, milliseconds })),
    doubts: (statistics?.doubts ?? []).map((doubt) => DOUBTS[doubt] ?? `Doubt ${doubt}.`),
  };
}

/** A result as it is drawn. `bytes` is the size of its message, `plane` that of echoed particles
 * with three components. */
export function decodeFrame(message: ReconstructedFrame, bytes: number, receivedAt: number,
                            plane: Plane): Frame {
  const relative = new Relative(message);
  return {
    sequence: message.sequence,
    time: message.time,
    bytes,
    receivedAt,
    origin: relative.origin,
    rings: decodeRings(message.rings, relative.points(message.rings?.points ?? EMPTY)),
    mesh: decodeMesh(message, relative),
    particles: message.particles.length > 0
      ? relativePositions(message.particleFormat, message.particles, plane, relative.origin)
      : null,
    statistics: decodeStatistics(message),
    ringsDigest: message.ringsDigest,
    meshDigest: message.meshDigest,
  };
}
