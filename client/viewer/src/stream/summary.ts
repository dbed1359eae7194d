import type { ReconstructedFrame } from '@proto/v1/reconstruction_pb';
import type { Frame } from '../protocol/frame';
import type { Summary } from './history';

/** Names of the stages in statistics. */
export const STAGES = [
  'bins', 'field', 'crossings', 'rings', 'normals', 'vertices', 'identities', 'mesh', 'attributes',
] as const;

/** Frames since the start of a track. */
export interface Counts { received: number; drawn: number; dropped: number }

/** Triangles that merging saves, in percent of the unmerged ones. NaN without triangles. */
export function reductionOf({ triangles, trianglesGrid }: Pick<Summary, 'triangles' | 'trianglesGrid'>): number {
  return trianglesGrid > 0 ? 100 * (1 - triangles / trianglesGrid) : NaN;
}

/** Rings and holes, by the sign of their areas; bodies and cavities, by the sign of their volumes. */
export function ringCounts(areas: Iterable<number>): { rings: number; holes: number } {
  let [rings, holes] = [0, 0];
  for (const area of areas) {
    if (area < 0) ++holes;
    else ++rings;
  }
  return { rings, holes };
}

/** Computes the figures of a frame outside the history: a frame with other settings, or a section. */
export function summaryOf({ statistics, rings, surface }: Frame): Summary {
  const { area, triangles, trianglesGrid, milliseconds } = statistics;
  return {
    area, ...ringCounts(surface?.measures.volume ?? rings.area), volume: statistics.volume, triangles, trianglesGrid, milliseconds,
    stages: STAGES.map(() => NaN), received: NaN, drawn: NaN, dropped: NaN, latency: NaN,
  };
}

/** The figures of a result. `counts`: of its track at its arrival; null for a frame from the server's history. */
export function summarise(frame: ReconstructedFrame, counts: Counts | null): Summary {
  const statistics = frame.statistics;
  const stages = STAGES.map(
    (name) => statistics?.stages.find(({ stage }) => stage === name)?.milliseconds ?? 0);
  return {
    area: statistics?.area ?? 0,
    ...ringCounts(frame.surface?.measures.map(({ volume }) => volume) ?? frame.rings?.measures.map(({ area }) => area) ?? []),
    volume: statistics?.volume,
    triangles: Number(statistics?.triangles ?? 0),
    trianglesGrid: Number(statistics?.trianglesGrid ?? 0),
    milliseconds: statistics?.milliseconds ?? 0,
    stages,
    ...counts ?? { received: NaN, drawn: NaN, dropped: NaN },
    latency: NaN,
  };
}
