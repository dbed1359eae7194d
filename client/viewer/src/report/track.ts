import type { Range as ValueRange } from '../draw/ramp';
import { type Bounds, union } from '../draw/view';
import type { Frame, Rings, Statistics } from '../protocol/frame';
import { type Entry, History, type Summary } from '../stream/history';
import { Player, type Range } from '../stream/player';
import { sentence } from '../stream/status';
import { STAGES } from '../stream/summary';
import type { Method, Track } from '../stream/track';
import { count } from '../ui/format';
import { decodeGeometry } from './geometry';

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
  colors?: [number, number];
  /** Area, perimeter, particles, identity, parents of each ring. */
  measures: [number | null, number | null, number, string, string[]][];
}

/** Frames per second at speed 1. */
const RATE = 12;

/** Frames larger than the median by this factor do not extend the initial view. */
const LARGEST_FRAME = 3;

const orNaN = (value: number | null) => value ?? NaN;

/** The frames of a report. Frame k has the sequence k + 1. Geometry is decoded on demand. */
export class ReportTrack implements Track {
  readonly kind = 'report';
  readonly history = new History(Infinity);
  readonly player: Player;
  readonly counts = { received: 0, drawn: 0, dropped: 0 };
  readonly state = { kind: 'well', text: '' } as const;
  readonly parameters = null;
  readonly bounds: Bounds | null;
  /** Range of the attribute `color` in all frames. */
  readonly colorRange: ValueRange | null;
  readonly hasIsolines: boolean;
  /** Distinct texts of doubts. A doubt is an index. */
  private readonly doubts: string[];
  private latest: { sequence: number; frame: Frame } | null = null;

  constructor(readonly title: string, readonly method: Method, readonly color: string,
              private readonly numbers: FrameNumbers[],
              private readonly geometryOf: (index: number) => string) {
    this.bounds = boundsOfAll(numbers);
    this.colorRange = rangeOfAll(numbers);
    this.doubts = [...new Set(numbers.flatMap(({ doubts }) => doubts))];
    numbers.forEach((one, k) => this.history.insert(this.entry(one, k + 1), Infinity));
    this.hasIsolines = numbers.length > 0 && this.frame(1).isolines !== null;
    this.player = new Player(this, false);
    this.player.loop = true;
    this.player.seek(1);
  }

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
    const { particles_shown: shown, particles_given: given } = numbers;
    return [
      numbers.mesh_shown ? '' : 'The mesh is too large for the report.',
      shown < given ? `The report has ${count(shown)} of ${count(given)} particles.` : '',
    ].filter(Boolean).join(' ');
  }

  private entry(numbers: FrameNumbers, sequence: number): Entry {
    const summary: Summary = {
      area: orNaN(numbers.area), rings: numbers.measures.length, triangles: numbers.triangles,
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
    const color = numbers.colors ? { name: this.color, range: numbers.colors } : null;
    const { origin, rings, isolines, mesh, particles } = decodeGeometry(this.geometryOf(sequence - 1), color);
    return {
      sequence: BigInt(sequence), time: orNaN(numbers.time), origin, rings: measured(rings, numbers),
      isolines, mesh, particles, statistics: this.statistics(numbers),
      ringsDigest: BigInt(`0x${numbers.rings_digest}`), meshDigest: BigInt(`0x${numbers.mesh_digest}`),
    };
  }

  private statistics(numbers: FrameNumbers): Statistics {
    return {
      particles: numbers.particles, triangles: numbers.triangles, trianglesGrid: numbers.triangles_grid,
      area: orNaN(numbers.area), perimeter: orNaN(numbers.perimeter), spacing: orNaN(numbers.spacing),
      milliseconds: orNaN(numbers.milliseconds), droppedHoles: numbers.dropped_holes,
      droppedComponents: numbers.dropped_components, droppedSpray: numbers.dropped_spray,
      selfIntersections: numbers.self_intersections, foldedTriangles: numbers.folded_triangles,
      doubts: numbers.doubts.map((text) => this.doubts.indexOf(text)),
    };
  }
}

function measured(rings: Rings, { measures }: FrameNumbers): Rings {
  return {
    ...rings,
    area: Float64Array.from(measures, ([area]) => orNaN(area)),
    perimeter: Float64Array.from(measures, ([, perimeter]) => orNaN(perimeter)),
    particles: Float64Array.from(measures, ([, , particles]) => particles),
    identities: BigUint64Array.from(measures, ([, , , identity]) => BigInt(identity)),
    parents: measures.map(([, , , , parents]) => parents.map(BigInt)),
  };
}

/** The bounds of all frames, without frames in which the scene has exploded. */
function boundsOfAll(numbers: FrameNumbers[]): Bounds | null {
  const boxes = numbers.map(({ box }) => box).filter((box) => box !== null)
    .map(([left, bottom, right, top]): Bounds => ({ left, bottom, right, top }));
  if (boxes.length === 0) return null;
  const side = ({ left, bottom, right, top }: Bounds) => Math.max(right - left, top - bottom);
  const sides = boxes.map(side).sort((a, b) => a - b);
  const limit = LARGEST_FRAME * sides[Math.floor(sides.length / 2)];
  return boxes.filter((box) => side(box) <= limit).reduce(union);
}

function rangeOfAll(numbers: FrameNumbers[]): ValueRange | null {
  const ranges = numbers.map(({ colors }) => colors).filter((range) => range !== undefined);
  if (ranges.length === 0) return null;
  return {
    min: Math.min(...ranges.map(([low]) => low)), max: Math.max(...ranges.map(([, high]) => high)),
  };
}
