import { Output, ReconstructFrameRequestSchema, ReconstructFrameResponseSchema } from '@proto/v1/reconstruction_pb';
import { shareOf } from '../input/share';
import { decodeResult } from '../protocol/decode';
import type { Frame } from '../protocol/frame';
import { particleChannels, particleSizes } from '../protocol/particles';
import type { Gateway } from './gateway';
import { NO_FRAME_BOXES } from './producer';
import { outputsFor, parametersOf, settingsText, type Settings } from './settings';
import { sentence } from './status';
import type { Track } from './track';
import { NO_PARTICLES } from './variant_stream';

/** Requests single frames of a file track that its stream lacks. Each is computed alone. One request at a time. */
export class Variant {
  result: Frame | null = null;
  /** The last error, or empty. */
  problem = '';
  private requested = '';
  private busy = false;
  /** Counts calls of `reset`: results of requests before the last one are dropped. */
  private epoch = 0;

  constructor(private readonly gateway: Gateway, private readonly changed: () => void) {}

  /** Requests a frame, unless a request is in progress, or the same frame and settings were requested last. */
  request(track: Track, sequence: number, settings: Settings): void {
    const key = `${track.title}|${sequence}|${settingsText(settings)}`;
    if (this.busy || key === this.requested) return;
    this.requested = key;
    this.busy = true;
    const { epoch } = this;
    this.fetch(track, sequence, settings)
      .then((result) => this.finish(epoch, result, ''))
      .catch((error: unknown) => this.finish(epoch, null, error instanceof Error ? error.message : String(error)));
  }

  /** Drops the result, so that the next call of `request` sends a request. */
  reset(): void {
    ++this.epoch;
    this.result = null;
    this.problem = '';
    this.requested = '';
  }

  private finish(epoch: number, result: Frame | null, problem: string): void {
    this.busy = false;
    if (epoch === this.epoch) {
      this.result = result;
      this.problem = problem;
    }
    this.changed();
  }

  private async fetch(track: Track, sequence: number, settings: Settings): Promise<Frame> {
    const particles = await track.particlesOf(sequence);
    if (!particles) {
      throw new Error(NO_PARTICLES);
    }
    if (particles.box && !(await this.gateway.info()).capabilities.includes('frame-boxes')) {
      throw new Error(sentence(NO_FRAME_BOXES));
    }
    const chosen = shareOf(particles, settings.share);
    const spacing = track.entryAt(sequence)?.frame().statistics.spacing ?? null;
    const parameters = parametersOf(settings, track.parameters, spacing);
    const response = await this.gateway.call(
      '/v1/frame', ReconstructFrameRequestSchema, ReconstructFrameResponseSchema, {
        parameters,
        outputs: outputsFor((particles.scalars ?? []).map(({ name }) => name), track.parameters?.output === Output.SURFACE),
        frame: chosen,
      });
    if (!response.frame) throw new Error('The response of the server has no frame.');
    const frame = response.frame;
    frame.sequence = BigInt(sequence);
    frame.particleFormat = chosen.positionFormat;
    frame.particles = chosen.positions;
    return {
      ...decodeResult(frame, track.parameters),
      particleSizes: particleSizes(chosen, parameters), particleAttributes: particleChannels(chosen),
    };
  }
}
