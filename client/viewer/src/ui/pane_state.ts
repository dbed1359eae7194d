import type { Track } from '../stream/track';

/** States of a pane, the most severe last. */
export const PANE_STATES = ['live', 'waiting', 'ended', 'doubtful', 'lost', 'refused'] as const;

export interface PaneState {
  kind: typeof PANE_STATES[number];
  /** One sentence or more for the status line. */
  text: string;
}

/** Names of the states for the user. A doubtful frame is of a live stream. */
const NAMES: Record<PaneState['kind'], string> = {
  live: 'Live', waiting: 'Waiting', ended: 'Ended', doubtful: 'Live', lost: 'Lost', refused: 'Refused',
};

export function stateName({ kind }: PaneState, track: Track): string {
  return track.kind === 'file' && NAMES[kind] === 'Live' ? 'File' : NAMES[kind];
}

/**
 * The state of a pane. `refusal`: why its frame is refused, or empty. `doubts`: of its frame, or
 * empty. `isShown`: whether the frame that the pane shows is the one that it should show.
 */
export function paneState(track: Track, refusal: string, doubts: string, isShown: boolean): PaneState {
  const { kind, text } = track.state;
  if (kind === 'failed') return { kind: 'refused', text };
  if (kind === 'lost') return { kind: 'lost', text };
  if (refusal) return { kind: 'refused', text: refusal };
  if (kind === 'busy' || !isShown) {
    return { kind: 'waiting', text: kind === 'busy' ? text : 'Waiting for the frame.' };
  }
  const warnings = [track.notice ?? '', doubts].filter(Boolean).join(' ');
  if (warnings) return { kind: 'doubtful', text: warnings };
  return { kind: kind === 'ended' ? 'ended' : 'live', text };
}

/** The most severe state, and its index; the first of several. */
export function mostSevere(states: readonly PaneState[]): number {
  let worst = 0;
  states.forEach(({ kind }, k) => {
    if (PANE_STATES.indexOf(kind) > PANE_STATES.indexOf(states[worst].kind)) worst = k;
  });
  return worst;
}
