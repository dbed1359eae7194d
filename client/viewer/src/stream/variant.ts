import {
  ReconstructFrameRequestSchema, ReconstructFrameResponseSchema, type ReconstructedFrame,
} from '@proto/v1/reconstruction_pb';
import { shareOf } from '../input/share';
import type { Gateway } from './gateway';
import { outputsFor, parametersOf, settingsText, type Settings } from './settings';
import type { Track } from './track';

export interface VariantResult {
  sequence: number;
  frame: ReconstructedFrame;
  bytes: number;
}

/** The frame that a track shows, reconstructed by itself with other settings: one request at a time,
 * always for the newest wish. */
export class Variant {
  result: VariantResult | null = null;
  /** Why there is none; empty: there is one, or it is on its way. */
  problem = '';
  private wanted = '';
  private busy = false;

  constructor(private readonly gateway: Gateway, private readonly changed: () => void) {}

  /** Asks for a frame; nothing happens while it is the one that was asked for last. */
  want(track: Track, sequence: number, settings: Settings): void {
    const key = `${track.title}|${sequence}|${settingsText(settings)}`;
    if (this.busy || key === this.wanted) return;
    this.wanted = key;
    this.busy = true;
    this.fetch(track, sequence, settings)
      .then((result) => {
        this.result = result;
        this.problem = '';
      })
      .catch((error: unknown) => {
        this.result = null;
        this.problem = error instanceof Error ? error.message : String(error);
      })
      .finally(() => {
        this.busy = false;
        this.changed();
      });
  }

  /** Forgets what it has, so that the same is asked for anew. */
  reset(): void {
    this.result = null;
    this.problem = '';
    this.wanted = '';
  }

  private async fetch(track: Track, sequence: number, settings: Settings): Promise<VariantResult> {
    const particles = await track.particlesOf(sequence);
    if (!particles) {
      throw new Error('Other settings need the particles, and this stream does not show them. ' +
                      'Start its producer with --echo-particles.');
    }
    const chosen = shareOf(particles, settings.share);
    const spacing = track.entryAt(sequence)?.parse().statistics?.spacing ?? null;
    const response = await this.gateway.call(
      '/v1/frame', ReconstructFrameRequestSchema, ReconstructFrameResponseSchema, {
        parameters: parametersOf(settings, track.parameters, spacing),
        outputs: outputsFor((particles.scalars ?? []).map(({ name }) => name)),
        frame: chosen,
      });
    if (!response.frame) throw new Error('The server gives no frame.');
    const frame = response.frame;
    frame.sequence = BigInt(sequence);
    frame.particleFormat = chosen.positionFormat;
    frame.particles = chosen.positions;
    return { sequence, frame, bytes: frame.mesh?.points.length ?? 0 };
  }
}
