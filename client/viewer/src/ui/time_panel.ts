import type { Track } from '../stream/track';
import { button, byId, input, select, setText } from './dom';
import { number } from './format';
import type { TextPace } from './text_pace';

/** Least move of the slider, as a share of its length, that the user can see. */
const SLIDER_STEP = 0.001;

/** Time controls of the chosen pane: follow, pause, step, scrub, speed. */
export class TimePanel {
  private readonly scrub = input('scrub');
  private readonly position = byId('position', HTMLElement);
  private scrubbing = false;
  /** The frame, and the position of the slider as a share of its length, that were written last. */
  private shown: number | null = null;
  private shownShare = NaN;

  /** `track`: of the chosen pane; `moved`: called after the user changed the position. */
  constructor(private readonly track: () => Track | null, private readonly moved: () => void) {
    button('live').addEventListener('click', () => this.act((track) => track.player.follow()));
    button('play').addEventListener('click', () => this.toggle());
    button('back').addEventListener('click', () => this.step(-1));
    button('forward').addEventListener('click', () => this.step(1));
    this.scrub.addEventListener('input', () => {
      this.act((track) => track.player.seek(this.scrub.valueAsNumber));
    });
    this.scrub.addEventListener('pointerdown', () => { this.scrubbing = true; });
    for (const end of ['pointerup', 'pointercancel', 'blur']) {
      this.scrub.addEventListener(end, () => { this.scrubbing = false; });
    }
    select('speed').addEventListener('change', () => {
      this.act((track) => { track.player.speed = Number(select('speed').value); });
    });
    input('loop').addEventListener('change', () => {
      this.act((track) => { track.player.loop = input('loop').checked; });
    });
  }

  /** Pauses at the visible frame, or plays from there. */
  toggle(): void {
    this.act((track) => {
      const { player } = track;
      if (player.mode === 'paused') player.play();
      else player.pause(this.visible(track));
    });
  }

  /** Pauses at the first (-1) or last (1) frame. */
  jump(to: 1 | -1): void {
    this.act((track) => {
      const range = track.range();
      if (range) track.player.seek(to < 0 ? range.first : range.last);
    });
  }

  follow(): void {
    this.act((track) => track.player.follow());
  }

  /** Steps to the previous (-1) or next (1) available frame. */
  step(by: 1 | -1): void {
    this.act(({ player, history, kind }) => {
      const at = player.sequence;
      if (at === null) return;
      const neighbour = by > 0 ? history.after(at) : history.atOrBefore(at - 1);
      player.seek(kind === 'watch' ? neighbour?.sequence ?? at : at + by);
    });
  }

  /** Updates the controls. Frame numbers are written at `pace`; without it at once. */
  refresh(pace: TextPace | null = null): void {
    const track = this.track();
    const range = track?.range() ?? null;
    const player = track?.player;
    const at = player?.sequence ?? null;
    const isWatch = track?.kind === 'watch';
    button('live').hidden = track !== null && !isWatch;
    button('live').setAttribute('aria-pressed', String(player?.mode === 'live'));
    setText(button('play'), player?.mode === 'paused' ? 'Play' : 'Pause');
    input('loop').parentElement?.toggleAttribute('hidden', isWatch || !track);
    for (const name of ['live', 'play', 'back', 'forward']) button(name).disabled = !track;
    this.scrub.disabled = !range;
    if (!range || !player) {
      setText(this.position, '–');
      return;
    }
    const speed = String(player.speed);
    if (select('speed').value !== speed) select('speed').value = speed;
    input('loop').checked = player.loop;
    const isDue = !pace || pace.isDue || (player.mode === 'paused' && at !== this.shown);
    const share = ((at ?? range.last) - range.first) / Math.max(1, range.last - range.first);
    const isMoved = player.mode === 'playing' && !(Math.abs(share - this.shownShare) < SLIDER_STEP);
    if (!this.scrubbing && (isDue || isMoved)) {
      this.setScrub(range.first, range.last, at ?? range.last);
      this.shownShare = share;
    }
    if (!isDue) return;
    this.shown = at;
    const label = (sequence: number) => track?.labelOf(sequence) ?? '';
    const text = `${at === null ? '–' : label(at)} of ${label(range.last)}`;
    if (this.position.textContent === text) return;
    this.position.textContent = text;
    pace?.written();
  }

  private visible(track: Track): number | null {
    const at = track.player.sequence;
    return at === null ? null : track.entryAt(at)?.sequence ?? at;
  }

  private setScrub(first: number, last: number, at: number): void {
    const [min, max, value] = [String(first), String(last), String(at)];
    if (this.scrub.min !== min) this.scrub.min = min;
    if (this.scrub.max !== max) this.scrub.max = max;
    if (this.scrub.value !== value) this.scrub.value = value;
    const time = this.track()?.entryAt(at)?.time;
    const label = this.track()?.labelOf(at) ?? '';
    const text = time === undefined ? `frame ${label}` : `frame ${label}, time ${number(time)}`;
    if (this.scrub.getAttribute('aria-valuetext') !== text) {
      this.scrub.setAttribute('aria-valuetext', text);
    }
  }

  private act(action: (track: Track) => void): void {
    const track = this.track();
    if (!track) return;
    action(track);
    this.moved();
    this.refresh();
  }
}
