import type { Track } from '../stream/track';
import { button, byId, input, select, setText } from './dom';
import { number } from './format';

/** Where in time the chosen pane is: follow, pause, step, scrub, speed. */
export class TimePanel {
  private readonly scrub = input('scrub');
  private scrubbing = false;

  /** `track`: of the chosen pane; `moved`: somebody went to another place. */
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

  /** Pauses at what is seen, or goes on from where it was paused. */
  toggle(): void {
    this.act((track) => {
      const { player } = track;
      if (player.mode === 'paused') player.play();
      else player.pause(this.seen(track));
    });
  }

  follow(): void {
    this.act((track) => track.player.follow());
  }

  /** To the next frame that there is, back or forward. */
  step(by: 1 | -1): void {
    this.act(({ player, history, kind }) => {
      const at = player.sequence;
      if (at === null) return;
      const neighbour = by > 0 ? history.after(at) : history.atOrBefore(at - 1);
      player.seek(kind === 'watch' ? neighbour?.sequence ?? at : at + by);
    });
  }

  /** Shows what the track does now. */
  refresh(): void {
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
      setText(byId('place', HTMLElement), '–');
      return;
    }
    if (!this.scrubbing) {
      this.setScrub(range.first, range.last, at ?? range.last);
    }
    select('speed').value = String(player.speed);
    input('loop').checked = player.loop;
    setText(byId('place', HTMLElement), `${at ?? '–'} of ${range.last}`);
  }

  private seen(track: Track): number | null {
    const at = track.player.sequence;
    return at === null ? null : track.entryAt(at)?.sequence ?? at;
  }

  private setScrub(first: number, last: number, at: number): void {
    const [min, max, value] = [String(first), String(last), String(at)];
    if (this.scrub.min !== min) this.scrub.min = min;
    if (this.scrub.max !== max) this.scrub.max = max;
    if (this.scrub.value !== value) this.scrub.value = value;
    const time = this.track()?.entryAt(at)?.time;
    const words = time === undefined ? `frame ${at}` : `frame ${at}, time ${number(time)}`;
    if (this.scrub.getAttribute('aria-valuetext') !== words) {
      this.scrub.setAttribute('aria-valuetext', words);
    }
  }

  private act(what: (track: Track) => void): void {
    const track = this.track();
    if (!track) return;
    what(track);
    this.moved();
    this.refresh();
  }
}
