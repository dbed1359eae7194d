import type { Mode } from '../stream/player';
import type { Track, TrackState } from '../stream/track';
import { byId, setText } from './dom';

/** Words that stay this long where nothing is wrong, in milliseconds. */
const SHORTLY = 4000;

/** How a stream that runs is looked at. */
const MODES: Record<Mode, string> = {
  live: 'Live', playing: 'Playing, behind the newest frame', paused: 'Paused. The stream goes on.',
};

/** One line in words: what is wrong and what to do, else how the stream does. */
export class StatusLine {
  private readonly element = byId('status', HTMLElement);
  /** Of something that a person did. */
  private said = '';
  private saidUntil = 0;
  private saidKind: TrackState['kind'] = 'well';
  /** Of the server, while it does not answer. */
  server = '';

  say(words: string, isError: boolean): void {
    this.said = words;
    this.saidKind = isError ? 'failed' : 'well';
    this.saidUntil = isError ? Infinity : performance.now() + SHORTLY;
  }

  /** `problem`: of the picture that is shown. */
  refresh(track: Track | null, problem: string, now: number): void {
    const state = track?.state;
    if (this.said && now < this.saidUntil) this.show(this.saidKind, this.said);
    else if (state && state.kind !== 'well') this.show(state.kind, state.words);
    else if (this.server) this.show('lost', this.server);
    else if (problem) this.show('failed', problem);
    else this.show('well', wellWords(track));
  }

  private show(kind: TrackState['kind'], words: string): void {
    this.element.dataset.kind = kind;
    setText(this.element, words);
  }
}

function wellWords(track: Track | null): string {
  if (!track) return 'Ready';
  const { words } = track.state;
  return words === MODES.live ? MODES[track.player.mode] : words;
}
