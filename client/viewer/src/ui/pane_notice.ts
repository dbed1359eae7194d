import type { Track } from '../stream/track';
import { make, setText } from './dom';
import type { PaneState } from './pane_state';

/** The notice over the picture of a pane: why it shows nothing, or a warning about its files or its stream. */
export class PaneNotice {
  private readonly text = make('span');
  private readonly switchButton = make('button', { type: 'button', title: 'Shows the stream that has this name now.' },
    'Switch to the new run');
  private readonly hideButton = make('button', {
    type: 'button', class: 'icon', 'aria-label': 'Hide notice', title: 'Hides this notice.',
  }, '✕');
  readonly element = make('div', { class: 'notice' }, this.text, this.switchButton, this.hideButton);
  /** The notice of the files that the user has hidden. */
  private hidden = '';

  constructor(private readonly track: () => Track) {
    this.hideButton.addEventListener('click', () => { this.hidden = this.track().notice ?? ''; });
    this.switchButton.addEventListener('click', () => this.track().switchRun?.());
  }

  /** `note`: a notice of the page, or empty. `hasFrame`: whether the pane shows a frame. */
  show({ kind, text }: PaneState, note: string, hasFrame: boolean): void {
    const track = this.track();
    const ofFiles = kind === 'doubtful' && track.notice !== this.hidden ? track.notice ?? '' : '';
    const isNoted = note !== '' || ofFiles !== '' || track.hasNewRun || kind === 'lost' || kind === 'refused' ||
      (kind === 'waiting' && !hasFrame);
    this.element.hidden = !isNoted || track.kind === 'report';
    this.switchButton.hidden = !track.hasNewRun;
    this.hideButton.hidden = ofFiles === '' || note !== '';
    if (isNoted) setText(this.text, note || ofFiles || text);
  }
}
