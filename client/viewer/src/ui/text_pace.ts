import type { Player } from '../stream/player';

/** Least time between two frames whose texts are written, in milliseconds. Numbers that change faster are not readable. */
const TEXT_MS = 100;

/**
 * Decides when the page writes the texts of a frame: numbers, captions, positions. Each writing costs a layout, which
 * takes longer than drawing the picture. Texts of a paused track are written at once.
 */
export class TextPace {
  /** Time of this refresh of the screen, in milliseconds. */
  now = 0;
  /** Whether texts of moving tracks are written in this refresh, all for the same frame. */
  isDue = true;
  private last = -Infinity;

  /** Begins a refresh of the screen. */
  begin(now: number): void {
    this.now = now;
    this.isDue = now - this.last >= TEXT_MS;
  }

  isDueFor({ player }: { player: Pick<Player, 'mode'> }): boolean { return this.isDue || player.mode === 'paused'; }

  /** Texts were written: the next ones are due after TEXT_MS. */
  written(): void { this.last = this.now; }
}
