import type { Range as ValueRange } from '../draw/ramp';
import { type Bounds, union } from '../draw/view';
import { channelsOf } from '../protocol/channels';
import type { Frame, Rings, Statistics } from '../protocol/frame';
import type { Outline } from '../protocol/sections';
import { type Entry, History, type Summary } from '../stream/history';
import { Player, type Range } from '../stream/player';
import { sentence } from '../stream/status';
import { ringCounts, STAGES } from '../stream/summary';
import type { Method, Track } from '../stream/track';
import { count } from '../ui/format';
import { decodeGeometry } from './geometry';
import type { SpacePart } from './space_part';
import { orNaN, surfaceFrame, type SurfaceNumbers, surfaceOmissions, surfaceSummary } from './surfaces';

/** Numbers of a frame, written by client/output/report.cc. Null: not finite. */
export interface FrameNumbers {
  /** Index of the frame in the input. */
  frame: number;
  particles: number;
  triangles_grid: number;
  triangles: number;
  self_intersections: number;
  folded_triangles: number;
  dropped_holes: number;
  dropped_components: number;
  dropped_spray: number;
  doubts: string[];
  time: number | null;
  area: number | null;
  perimeter: number | null;
  spacing: number | null;
  milliseconds: number | null;
  stages: Record<string, number>;
  particles_shown: number;
  particles_given: number;
  mesh_shown: boolean;
  rings_digest: string;
  mesh_digest: string;
  box: [number, number, number, number] | null;
  /** Range of each channel of the attribute: a scalar, or the magnitude and the components. */
  colors?: [number, number][];
  measures: Measures;
  sections: {
    area: number | null;
    perimeter: number | null;
    particles: number;
    rings_digest: string;
    measures: Measures;
  }[];
}

/** Area, perimeter, particles, identity, parents of each ring. */
type Measures = [number | null, number | null, number, string, string[]][];

/** Frames per second at speed 1. */
const RATE = 12;

/** Frames larger than the median by this factor do not extend the initial view. */
const LARGEST_FRAME = 3;

const isSurface = (numbers: FrameNumbers | SurfaceNumbers): numbers is SurfaceNumbers => 'bodies' in numbers;

/** The frames of a report. Frame k has the sequence k + 1. Geometry is decoded on demand. */
export class ReportTrack implements Track {
  readonly kind = 'report';
  readonly history = new History(Infinity);
  readonly player: Player;
  readonly counts = { received: 0, drawn: 0, dropped: 0 };
  readonly state = { kind: 'well', text: '' } as const;
  readonly parameters = null;
  readonly bounds: Bounds | null;
  /** Range of each channel of the attribute `color` in all frames. */
  readonly colorRanges: ReadonlyMap<string, ValueRange>;
  /** Distinct texts of doubts. The number of a doubt is its index here. */
  private readonly doubts: string[];
  private latest: { sequence: number; frame: Frame } | null = null;

  constructor(readonly title: string, readonly method: Method, readonly color: string,
              readonly outlines: readonly Outline[], private readonly numbers: (FrameNumbers | SurfaceNumbers)[],
              private readonly geometryOf: (index: number) => string, private readonly spacePart: SpacePart | null) {
    const flat = numbers.flatMap((one) => (isSurface(one) ? [] : [one]));
    this.bounds = boundsOfAll(flat);
    this.colorRanges = rangesOfAll(color, flat);
    this.doubts = [...new Set(numbers.flatMap(({ doubts }) => doubts))];
    numbers.forEach((one, k) => this.history.insert(this.entry(one, k + 1), Infinity));
    this.player = new Player(this, false);
    this.player.loop = true;
    this.player.seek(1);
  }

  get hasSurfaces(): boolean { return this.numbers.some(isSurface); }

  range(): Range | null { return this.numbers.length > 0 ? { first: 1, last: this.numbers.length } : null; }
  rate(): number { return RATE; }
  livePosition(): null { return null; }
  entryAt(sequence: number): Entry | null { return this.history.get(sequence); }
  labelOf(sequence: number): string { return String(this.numbers[sequence - 1]?.frame ?? sequence); }
  doubtText(doubt: number): string { return sentence(this.doubts[doubt]); }
  async particlesOf(): Promise<null> { return null; }
  refresh(): void {}
  close(): void {}

  sequenceOf(label: number): number {
    const k = this.numbers.findIndex(({ frame }) => frame >= Math.round(label));
    return k < 0 ? this.numbers.length : k + 1;
  }

  /** Parts of the frame that the report leaves out; empty if it has all. */
  omissions(sequence: number): string {
    const numbers = this.numbers[sequence - 1];
    if (!numbers) return '';
    if (isSurface(numbers)) return surfaceOmissions(numbers);
    const { particles_shown: shown, particles_given: given } = numbers;
    return [
      numbers.mesh_shown ? '' : 'The mesh is too large for the report.',
      shown < given ? `The report has ${count(shown)} of ${count(given)} particles.` : '',
    ].filter(Boolean).join(' ');
  }

  private entry(numbers: FrameNumbers | SurfaceNumbers, sequence: number): Entry {
    const summary: Summary = isSurface(numbers) ? surfaceSummary(numbers) : {
      area: orNaN(numbers.area), triangles: numbers.triangles,
      ...ringCounts(numbers.measures.map(([area]) => area ?? 0)),
      trianglesGrid: numbers.triangles_grid, milliseconds: orNaN(numbers.milliseconds),
      stages: STAGES.map((name) => numbers.stages[name] ?? 0),
      received: NaN, drawn: NaN, dropped: NaN, latency: 0,
    };
    return {
      sequence, time: orNaN(numbers.time), receivedAt: 0, bytes: 0, summary,
      frame: () => this.frame(sequence),
    };
  }

  private frame(sequence: number): Frame {
    if (this.latest?.sequence !== sequence) {
      this.latest = { sequence, frame: this.decode(sequence) };
    }
    return this.latest.frame;
  }

  private decode(sequence: number): Frame {
    const numbers = this.numbers[sequence - 1];
    if (isSurface(numbers)) {
      return surfaceFrame(this.geometryOf(sequence - 1), numbers, sequence, this.doubtsOf(numbers), this.spacePart);
    }
    const colors = numbers.colors ? { name: this.color, ranges: numbers.colors } : null;
    const { sections, ...geometry } = decodeGeometry(this.geometryOf(sequence - 1), colors);
    const frame: Frame = {
      ...geometry, particles: geometry.particles.length > 0 ? geometry.particles : null, sequence: BigInt(sequence), time: orNaN(numbers.time),
      rings: measured(geometry.rings, numbers.measures), sections: [], isolines: [],
      statistics: this.statistics(numbers),
      ringsDigest: BigInt(`0x${numbers.rings_digest}`), meshDigest: BigInt(`0x${numbers.mesh_digest}`),
    };
    return { ...frame, sections: sections.map((rings, k) => this.section(frame, rings, numbers.sections[k])) };
  }

  /** A section of a frame. The report has no mesh of it. */
  private section(frame: Frame, rings: Rings, numbers: FrameNumbers['sections'][0]): Frame {
    const { spacing } = frame.statistics;
    return {
      ...frame, rings: measured(rings, numbers.measures), mesh: null, particles: null,
      particleAttributes: null, ringsDigest: BigInt(`0x${numbers.rings_digest}`), meshDigest: null,
      statistics: {
        ...UNKNOWN, particles: numbers.particles, area: orNaN(numbers.area),
        perimeter: orNaN(numbers.perimeter), spacing,
      },
    };
  }

  private statistics(numbers: FrameNumbers): Statistics {
    return {
      particles: numbers.particles, triangles: numbers.triangles, trianglesGrid: numbers.triangles_grid,
      area: orNaN(numbers.area), perimeter: orNaN(numbers.perimeter), spacing: orNaN(numbers.spacing),
      milliseconds: orNaN(numbers.milliseconds), droppedHoles: numbers.dropped_holes,
      droppedComponents: numbers.dropped_components, droppedSpray: numbers.dropped_spray,
      selfIntersections: numbers.self_intersections, foldedTriangles: numbers.folded_triangles,
      doubts: this.doubtsOf(numbers),
    };
  }

  private doubtsOf({ doubts }: { doubts: string[] }): number[] {
    return doubts.map((text) => this.doubts.indexOf(text));
  }
}

const UNKNOWN: Statistics = {
  particles: NaN, triangles: NaN, trianglesGrid: NaN, area: NaN, perimeter: NaN, spacing: NaN, milliseconds: NaN,
  droppedHoles: 0, droppedComponents: 0, droppedSpray: 0, selfIntersections: 0, foldedTriangles: 0, doubts: [],
};

function measured(rings: Rings, measures: Measures): Rings {
  return {
    ...rings,
    area: Float64Array.from(measures, ([area]) => orNaN(area)),
    perimeter: Float64Array.from(measures, ([, perimeter]) => orNaN(perimeter)),
    particles: Float64Array.from(measures, ([, , particles]) => particles),
    identities: BigUint64Array.from(measures, ([, , , identity]) => BigInt(identity)),
    parents: measures.map(([, , , , parents]) => parents.map(BigInt)),
  };
}

/** The bounds of all frames that are at most LARGEST_FRAME times as large as the median one; null without bounds. */
function boundsOfAll(numbers: FrameNumbers[]): Bounds | null {
  const boxes = numbers.map(({ box }) => box).filter((box) => box !== null)
    .map(([left, bottom, right, top]): Bounds => ({ left, bottom, right, top }));
  if (boxes.length === 0) return null;
  const side = ({ left, bottom, right, top }: Bounds) => Math.max(right - left, top - bottom);
  const sides = boxes.map(side).sort((a, b) => a - b);
  const limit = LARGEST_FRAME * sides[Math.floor(sides.length / 2)];
  return boxes.filter((box) => side(box) <= limit).reduce(union);
}

function rangesOfAll(color: string, numbers: FrameNumbers[]): Map<string, ValueRange> {
  const frames = numbers.map(({ colors }) => colors).filter((ranges) => ranges !== undefined);
  const count = frames[0]?.length ?? 0;
  const channels = count === 0 ? [] : channelsOf(color, Math.max(1, count - 1));
  return new Map(channels.map((channel, k) => [channel, {
    min: Math.min(...frames.map((ranges) => ranges[k][0])),
    max: Math.max(...frames.map((ranges) => ranges[k][1])),
  }]));
}
