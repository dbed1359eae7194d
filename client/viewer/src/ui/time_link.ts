import type { Track } from '../stream/track';

/** Moves the tracks of a page to the simulation time of one of them. */
export class TimeLink {
  isOn = true;
  private leader: Track | null = null;
  /** Tracks that this link has moved, and paused at this frame. */
  private readonly held = new Map<Track, number>();

  /** Whether a track shows the time of another one. */
  holds(track: Track): boolean { return this.held.has(track); }

  /** Called once per refresh of the screen. `chosen`: the track that the user moves in time. */
  refresh(chosen: Track | null, tracks: readonly Track[]): void {
    for (const track of this.held.keys()) {
      if (!this.isOn || !tracks.includes(track)) this.held.delete(track);
    }
    if (chosen !== this.leader) this.lead(chosen);
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

  /** Playing goes on if the user chooses another track, unless the user has moved it since. */
  private lead(chosen: Track | null): void {
    const former = this.leader;
    this.leader = chosen;
    const heldAt = chosen ? this.held.get(chosen) : undefined;
    if (!chosen || heldAt === undefined) return;
    this.held.delete(chosen);
    if (former?.player.mode !== 'playing' || chosen.player.sequence !== heldAt) return;
    chosen.player.speed = former.player.speed;
    chosen.player.play();
  }

  private move(track: Track, time: number): void {
    const entry = track.history.nearestInTime(time);
    if (!entry) return;
    this.held.set(track, entry.sequence);
    const { mode, sequence } = track.player;
    if (mode !== 'paused' || sequence !== entry.sequence) track.player.seek(entry.sequence);
  }

  /** Streams follow their newest frame again. */
  private release(): void {
    for (const track of this.held.keys()) track.player.follow();
    this.held.clear();
  }
}
