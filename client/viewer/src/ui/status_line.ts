import type { Mode } from '../stream/player';
import type { Track, TrackState } from '../stream/track';
import { byId, setText } from './dom';

/** Duration of a message that is not an error, in milliseconds. */
const MESSAGE_MS = 4000;

/** Texts of a healthy stream. */
const MODES: Record<Mode, string> = {
  live: 'Live', playing: 'Playing behind the newest frame', paused: 'Paused. The stream continues.',
};

/** The status line: an error with its remedy, or else the state of the stream. */
export class StatusLine {
  private readonly element = byId('status', HTMLElement);
  /** Response to an action of the user. */
  private message = '';
  private messageUntil = 0;
  private messageKind: TrackState['kind'] = 'well';
  /** Error of the server, or empty. */
  server = '';

  report(text: string, isError: boolean): void {
    this.message = text;
    this.messageKind = isError ? 'failed' : 'well';
    this.messageUntil = isError ? Infinity : performance.now() + MESSAGE_MS;
  }

  /** `problem`: of the chosen pane. */
  refresh(track: Track | null, problem: string, now: number): void {
    const state = track?.state;
    if (this.message && now < this.messageUntil) this.show(this.messageKind, this.message);
    else if (state && state.kind !== 'well') this.show(state.kind, state.text);
    else if (this.server) this.show('lost', this.server);
    else if (problem) this.show('failed', problem);
    else this.show('well', wellText(track));
  }

  private show(kind: TrackState['kind'], text: string): void {
    this.element.dataset.kind = kind;
    setText(this.element, text);
  }
}

function wellText(track: Track | null): string {
  if (!track) return 'Ready';
  const { text } = track.state;
  return text === MODES.live ? MODES[track.player.mode] : text;
}
