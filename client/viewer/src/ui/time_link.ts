import type { Track } from '../stream/track';

/** Moves the tracks of a page to the simulation time of one of them. */
export class TimeLink {
  isOn = true;
  private leader: Track | null = null;
  /** Tracks that this link has moved and paused. */
  private readonly held = new Set<Track>();

  /** Whether a track shows the time of another one. */
  holds(track: Track): boolean { return this.held.has(track); }

  /** Called once per refresh of the screen. `chosen`: the track that the user moves in time. */
  refresh(chosen: Track | null, tracks: readonly Track[]): void {
    for (const track of this.held) {
      if (!this.isOn || !tracks.includes(track)) this.held.delete(track);
    }
    this.choose(chosen);
    if (!this.isOn || !chosen) return;
    if (chosen.player.mode === 'live') {
      this.release();
      return;
    }
    const { sequence } = chosen.player;
    const time = sequence === null ? undefined : chosen.entryAt(sequence)?.time;
    if (time === undefined) return;
    for (const track of tracks) {
      if (track !== chosen) this.move(track, time);
    }
  }

  /**
   * Makes a track the leader, which the other tracks follow. If the former leader plays, the new one continues to play.
   * Call it as soon as the user chooses. Otherwise the link would undo the user's next action on the track.
   */
  choose(chosen: Track | null): void {
    if (chosen === this.leader) return;
    const former = this.leader;
    this.leader = chosen;
    if (!chosen || !this.held.delete(chosen) || former?.player.mode !== 'playing') return;
    chosen.player.speed = former.player.speed;
    chosen.player.play();
  }

  private move(track: Track, time: number): void {
    const entry = track.history.nearestInTime(time);
    if (!entry) return;
    this.held.add(track);
    const { mode, sequence } = track.player;
    if (mode !== 'paused' || sequence !== entry.sequence) track.player.seek(entry.sequence);
  }

  /** Streams follow their newest frame again. */
  private release(): void {
    for (const track of this.held) track.player.follow();
    this.held.clear();
  }
}
