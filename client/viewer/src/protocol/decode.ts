import {
  CoordinateFormat, type Mesh as MeshMessage, Output, Plane, type ReconstructedFrame,
  type ReconstructionParameters, type Rings as RingsMessage,
} from '@proto/v1/reconstruction_pb';
import { arrayOf, bytesOf } from './arrays';
import { AttributeChannels, type Channels } from './channels';
import { checkNesting, countCheck, lost, offsetsOf } from './checks';
import { bareRings, type Frame, type Mesh, type Rings, type Statistics } from './frame';
import { type Particles, particleChannels, particleSizes, type SizeParameters } from './particles';
import { relativePositions } from './positions';
import { surfaceMessageOf } from './surface';

const EMPTY = new Uint8Array(0);

/** Converts coordinates to float32 relative to `origin`: the message's, or the first point of float64 coordinates. */
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
 * The mesh of a message. Arrays of a message are rarely aligned, and copying an array takes longer
 * than its upload. An array is therefore copied only when it is first read as numbers.
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

const NO_RINGS = bareRings(new Float32Array(0), new Uint32Array(1));
/** A ring has at least three points. */
const FEWEST_OF_RING = 3;

/** Decodes rings, and checks all arrays against the numbers of rings and points. */
function decodeRings(message: RingsMessage, relative: Relative): Rings {
  const { measures, identities, normals } = message;
  if (message.points.length % (relative.isRelative() ? 8 : 16) !== 0) throw lost('rings.points', 'is no array of points');
  const points = relative.points(message.points);
  const count = points.length / 2;
  // A frame without rings may have no offsets.
  const offsets = message.offsets.length === 0 && count === 0
    ? new Uint32Array(1) : offsetsOf(message.offsets, 'rings.offsets', 'ring', FEWEST_OF_RING);
  const rings = offsets.length - 1;
  if (offsets[rings] !== count) throw lost('rings.offsets', `must end with the ${count} points`);
  const check = countCheck('ring', rings);
  check(message.outerOf.length === 4 * rings, 'rings.outer_of', 'a uint32');
  check([0, 8 * rings].includes(identities.length), 'rings.identities', 'a uint64');
  check(measures.length === rings, 'rings.measures', 'an entry');
  if (![0, 8 * count].includes(normals.length)) throw lost('rings.normals', `must have two floats for each of the ${count} points`);
  const outerOf = arrayOf(Uint32Array, message.outerOf);
  checkNesting(outerOf, 'rings.outer_of', 'ring');
  const chosenPoints = (bytes: Uint8Array, field: string) => {
    const chosen = arrayOf(Uint32Array, bytes);
    if (bytes.length % 4 !== 0 || !chosen.every((point, k) => point < count && (k === 0 || chosen[k - 1] < point))) {
      throw lost(field, `must be ascending numbers of the ${count} points`);
    }
    return chosen;
  };
  const contacts = chosenPoints(message.contacts, 'rings.contacts');
  const contactAngles = arrayOf(Float32Array, message.contactAngles);
  if (message.contactAngles.length !== 4 * contacts.length || !contactAngles.every(Number.isFinite)) {
    throw lost('rings.contact_angles', `must be a finite number for each of the ${contacts.length} contacts`);
  }
  return {
    points, offsets, outerOf,
    identities: identities.length > 0 ? arrayOf(BigUint64Array, identities) : new BigUint64Array(rings),
    area: Float64Array.from(measures, ({ area }) => area),
    perimeter: Float64Array.from(measures, ({ perimeter }) => perimeter),
    particles: Float64Array.from(measures, ({ particleCount }) => Number(particleCount)),
    parents: measures.map((measure) => measure.parentIdentities),
    cuts: chosenPoints(message.cuts, 'rings.cuts'),
    wetted: chosenPoints(message.wetted, 'rings.wetted'),
    contacts, contactAngles,
    normals: normals.length > 0 ? arrayOf(Float32Array, normals) : null,
    attributes: new AttributeChannels(message.attributes),
  };
}

/** The outline and its mesh. For a message that contradicts itself: neither, and the reason as `problem`. */
function decodeOutline(message: ReconstructedFrame, relative: Relative): Pick<Frame, 'rings' | 'mesh' | 'problem'> {
  try {
    const rings = message.rings ? decodeRings(message.rings, relative) : NO_RINGS;
    return { rings, mesh: message.mesh ? new MessageMesh(message.mesh, relative) : null };
  } catch (error) {
    return { rings: NO_RINGS, mesh: null, problem: `Frame ${message.sequence} cannot be shown: ${(error as Error).message}` };
  }
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

/** Decodes a section. Its message has neither sequence nor time, so it gets both from the frame. */
function decodeSection(section: ReconstructedFrame, { sequence, time }: ReconstructedFrame): Frame {
  return decodeFrame({ ...section, sequence, time }, Plane.UNSPECIFIED);
}

/** The parameters that decide how a result is decoded. */
export type ResultParameters = SizeParameters & Pick<ReconstructionParameters, 'output' | 'plane'>;

/** The input particles that the server returned in a result, as they were sent. */
export function echoedParticles(message: ReconstructedFrame): Particles {
  return {
    time: message.time, positionFormat: message.particleFormat, positions: message.particles,
    ids: message.particleIds, volumes: message.particleVolumes, velocities: message.particleVelocities,
    scalars: message.particleScalars.map(({ name, values, components }) =>
      ({ name, values, components: Math.max(components, 1) })),
  };
}

/** Numbers of the returned input particles to colour by; null without particles or without such numbers. */
function echoedChannels(message: ReconstructedFrame): Channels | null {
  if (message.particles.length === 0) return null;
  const channels = particleChannels(echoedParticles(message));
  return [...channels.keys()].length > 0 ? channels : null;
}

/**
 * Decodes a result. `plane`: the coordinate plane onto which returned input particles with x, y, z are projected. `sizes`:
 * of the stream; null for equal sizes.
 */
export function decodeFrame(message: ReconstructedFrame, plane: Plane, sizes: SizeParameters | null = null): Frame {
  const relative = new Relative(message);
  return {
    sequence: message.sequence,
    time: message.time,
    origin: relative.origin,
    ...decodeOutline(message, relative),
    sections: message.sections.map((section) => decodeSection(section, message)),
    isolines: [],
    particles: message.particles.length > 0
      ? relativePositions(message.particleFormat, message.particles, plane, relative.origin)
      : null,
    particleSizes: particleSizes(echoedParticles(message), sizes),
    particleAttributes: echoedChannels(message),
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
    rings: NO_RINGS,
    sections: sections.map((section) => decodeSection(section, message)),
    isolines: [],
    mesh: null,
    particles: null,
    particleAttributes: echoedChannels(message),
    statistics: decodeStatistics(message),
    ringsDigest: 0n,
    meshDigest: null,
    surface: surfaceMessageOf(message),
  };
}

/** Decodes a result of a stream with these parameters; null: they are not known. */
export function decodeResult(message: ReconstructedFrame, parameters: ResultParameters | null): Frame {
  return parameters?.output === Output.SURFACE
    ? decodeSpaceFrame(message) : decodeFrame(message, parameters?.plane ?? Plane.UNSPECIFIED, parameters);
}
