import type { Plane, ReconstructionParameters } from '@proto/v1/reconstruction_pb';
import type { Entry, History } from './history';
import type { Playable, Player } from './player';
import type { Particles } from '../protocol/particles';
import type { Settings } from './settings';
import type { Counts } from './summary';

/** Bytes of messages that a track keeps for going back. */
export const HISTORY_BYTES = 64 << 20;

/** How a track does, for a person. */
export interface TrackState {
  /** `busy`: on its way; `lost`: trying again; `failed`: a person has to do something. */
  kind: 'busy' | 'well' | 'lost' | 'ended' | 'failed';
  words: string;
}

/** Results over time: of a stream that is watched, or of files that were dropped. */
export interface Track extends Playable {
  readonly kind: 'watch' | 'file';
  readonly title: string;
  readonly player: Player;
  readonly history: History;
  readonly counts: Counts;
  readonly state: TrackState;
  /** As the server resolved them; null until it has. */
  readonly parameters: ReconstructionParameters | null;
  readonly plane: Plane;
  /** What is to be shown at a place; null where it is not there yet. */
  entryAt(sequence: number): Entry | null;
  /** The particles of a frame, for another reconstruction; null where nobody has them. */
  particlesOf(sequence: number): Promise<Particles | null>;
  /** What its frames are made with; only of files. */
  readonly settings?: Settings;
  /** Does it all again with other settings; only of files. */
  reopen?(settings: Settings): void;
  /** To be called where the player is at another place: fetches what is missing there. */
  moved(): void;
  close(): void;
}
