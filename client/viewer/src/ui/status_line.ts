import type { Mode } from '../stream/player';
import type { Track } from '../stream/track';
import { byId, setText } from './dom';
import { mostSevere, PANE_STATES, type PaneState } from './pane_state';

/** Duration of a message, and of an error without a known cause, in milliseconds. */
const MESSAGE_MS = 4000;
const ERROR_MS = 20_000;

/** Texts of a healthy stream. */
const MODES: Record<Mode, string> = {
  live: 'Live', playing: 'Playing behind the newest frame', paused: 'Paused. The stream continues.',
};

/** A message for the user. `isGone`: whether its cause has gone. */
interface Message extends PaneState { until: number; isGone: () => boolean }

/** The status line: the most severe of the page's and the panes' errors, or else the state of the stream. */
export class StatusLine {
  private readonly element = byId('status', HTMLElement);
  private message: Message | null = null;
  /** Error of the server, or empty. */
  server = '';

  /** Shows the response to an action of the user, until its cause has gone or time has passed. */
  report(text: string, isError: boolean, isGone: () => boolean = () => false): void {
    const until = performance.now() + (isError ? ERROR_MS : MESSAGE_MS);
    this.message = text === '' ? null : { kind: isError ? 'refused' : 'live', text, until, isGone };
  }

  /** `states`: of all panes. `chosen`: index of the chosen one. */
  refresh(states: readonly PaneState[], chosen: number, track: Track | null, now: number): void {
    if (this.message && (now >= this.message.until || this.message.isGone())) this.message = null;
    const all: PaneState[] = [];
    if (this.message?.kind === 'refused') all.push(this.message);
    if (this.server) all.push({ kind: 'lost', text: this.server });
    // The chosen pane comes first, because the first of equally severe states is shown.
    const order = [...states.keys()].sort((a, b) => Number(b === chosen) - Number(a === chosen));
    for (const k of order) {
      const name = states.length > 1 && k !== chosen ? `Picture ${k + 1}: ` : '';
      all.push({ kind: states[k].kind, text: name + states[k].text });
    }
    const worst = all[mostSevere(all)];
    const isSerious = worst && PANE_STATES.indexOf(worst.kind) >= PANE_STATES.indexOf('doubtful');
    if (this.message && !isSerious) this.show('live', this.message.text);
    else if (!worst) this.show('live', 'Ready');
    else if (worst.kind === 'live') this.show('live', liveText(track, states[chosen]?.text ?? worst.text));
    else this.show(worst.kind, worst.text);
  }

  private show(kind: PaneState['kind'], text: string): void {
    this.element.dataset.kind = kind;
    setText(this.element, text);
  }
}

function liveText(track: Track | null, text: string): string {
  return track && text === MODES.live ? MODES[track.player.mode] : text;
}
