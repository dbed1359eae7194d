import type { ReconstructionParameters } from '@proto/v1/reconstruction_pb';
import type { Bounds } from '../draw/view';
import type { Entry, History } from './history';
import type { Playable, Player } from './player';
import type { Channels } from '../protocol/channels';
import type { ParticleSizes } from '../protocol/frame';
import type { Particles } from '../protocol/particles';
import type { Outline } from '../protocol/sections';
import type { Settings } from './settings';
import type { Counts } from './summary';

/** Limit of a track's history, in bytes of messages. */
export const HISTORY_BYTES = 64 << 20;
/** Share of the history from which on frames wait for the player. */
const FULL_SHARE = 0.9;
/** Frames kept before the player's position if the history is full. */
export const KEPT_BEHIND = 8;

/** Whether a history has room for a frame: it is not full, or can evict frames well before `position`, or needs the frame next. */
export function hasCapacityFor({ first, bytes }: Pick<History, 'first' | 'bytes'>, sequence: number, position: number): boolean {
  if (!first || bytes < FULL_SHARE * HISTORY_BYTES) return true;
  return first.sequence < position - KEPT_BEHIND || sequence <= position + 1;
}

export interface TrackState {
  /** `lost`: retrying; `failed`: the user must act. */
  kind: 'busy' | 'well' | 'lost' | 'ended' | 'failed';
  /** For the status line. */
  text: string;
}

/** Names of placement and fill. */
export interface Method { placement: string; fill: string }

/** Particles to draw: x, y of each, their own sizes, and their numbers. */
export interface DrawnParticles { points: Float32Array; sizes: ParticleSizes | null; attributes: Channels }

/** The frames of curves: of a track, or of a variant of it. */
export type CurveSource = Pick<Track, 'history' | 'player' | 'labelOf' | 'sequenceOf'>;

/** A sequence of results: a watched stream, dropped files, or the frames of a report. */
export interface Track extends Playable {
  readonly kind: 'watch' | 'file' | 'report';
  readonly title: string;
  readonly player: Player;
  readonly history: History;
  readonly counts: Counts;
  readonly state: TrackState;
  /** Null until the server has answered. */
  readonly method: Method | null;
  /** As resolved by the server; null until it has answered. */
  readonly parameters: ReconstructionParameters | null;
  /** The outlines of each frame: its own, then its sections. */
  readonly outlines: readonly Outline[];
  /** Bounds of all frames; null if they are unknown. */
  readonly bounds: Bounds | null;
  /** The entry to show at a sequence; null if it is not available yet. */
  entryAt(sequence: number): Entry | null;
  /** The number of a frame for the user. */
  labelOf(sequence: number): string;
  /** The inverse of `labelOf`; for a label between two frames, the next one. */
  sequenceOf(label: number): number;
  doubtText(doubt: number): string;
  /** Why a frame is refused; empty if it is not. */
  refusalOf?(sequence: number): string;
  /** Whether another stream has the name now. This track keeps showing the former one. */
  readonly hasNewRun?: boolean;
  /** Drops the former stream and shows the one that has the name now. */
  switchRun?(): void;
  /** A warning about the files for the user, or empty. Files only. */
  readonly notice?: string;
  /** Particles of a frame, for another reconstruction; null if they are not available. */
  particlesOf(sequence: number): Promise<Particles | null>;
  /** The particles relative to `origin`, for a frame whose result lacks them. */
  drawnParticles?(sequence: number, origin: [number, number]): Promise<DrawnParticles>;
  /** Settings of all frames. Files only. */
  readonly settings?: Settings;
  /** Reconstructs all frames with other settings. Files only. */
  reopen?(settings: Settings): void;
  /** Called once per refresh of the screen: fetches frames that the player needs. */
  refresh(): void;
  close(): void;
}
