import { toBinary } from '@bufbuild/protobuf';
import { ReconstructionParametersSchema, type ReconstructedFrame } from '@proto/v1/reconstruction_pb';
import { InputError } from '../input/source';
import { shareOf } from '../input/share';
import { decodeFrame } from '../protocol/decode';
import { particleChannels, type Particles, particleSizes } from '../protocol/particles';
import { relativePositions } from '../protocol/positions';
import { Backoff } from './backoff';
import type { Gateway } from './gateway';
import { History, type Entry } from './history';
import { parseResult, Producer } from './producer';
import { outputsFor, parametersOf, type Settings } from './settings';
import { CallError, describe, mayRetry, sentence, type CallStatus } from './status';
import { summarise, type Counts } from './summary';
import { type CurveSource, hasCapacityFor, HISTORY_BYTES, KEPT_BEHIND, type Track } from './track';

/** Number of frames computed before the first one shown, so that its rings are steady and tracked. */
const WARM_UP = 25;
/** Frames that the variant may be behind before it skips some. */
const MOST_BEHIND = 300;
/** Time that the player must stay at an earlier frame before the stream starts again there. */
const REST_MS = 200;

export const NO_PARTICLES = 'Other settings need the particles, which this stream does not send. ' +
  'Start its producer with --echo-particles.';

/** The first frame to send, so that `target` can be shown: WARM_UP frames before it, or the first one available. */
export function firstOf(target: number, available: number): number {
  return Math.min(target, Math.max(available, target - WARM_UP));
}

/** The next frame to send after `last`, of the frames in the history. Skips frames if it is far behind `target`. */
export function nextOf(history: Pick<History, 'after'>, last: number, target: number): number | null {
  const from = target - last > MOST_BEHIND ? target - WARM_UP - 1 : last;
  return history.after(from)?.sequence ?? null;
}

/**
 * The frames of a track with other settings: a temporary stream on the server, with its own state,
 * identities, curves and times. Sends the particles of the track in order, from WARM_UP frames before
 * the one shown, and skips frames if it is MOST_BEHIND behind. Starts again if the player stays at a
 * frame before the first frame sent.
 */
export class VariantStream implements CurveSource {
  readonly history = new History(HISTORY_BYTES);
  /** The server's id of the stream. */
  streamId = '';
  private readonly counts: Counts = { received: 0, drawn: 0, dropped: 0 };
  private readonly backoff = new Backoff();
  private readonly base: string;
  private producer: Producer | null = null;
  private isClosed = false;
  /** Why the stream cannot go on, or empty. */
  private problem = '';
  private refusals = new Map<number, string>();
  /** The track's sequences of frames given to the producer, and the last one chosen. */
  private sent: number[] = [];
  private last = 0;
  private first = 0;
  private target = 0;
  private targetSince = 0;
  private retryAt = 0;
  private wakeSender: (() => void) | null = null;

  constructor(private readonly gateway: Gateway, readonly track: Track, private readonly settings: Settings) {
    this.base = baseOf(track);
  }

  get player() { return this.track.player; }
  labelOf(sequence: number): string { return this.track.labelOf(sequence); }
  sequenceOf(label: number): number { return this.track.sequenceOf(label); }

  /** Whether the track still has the stream, and the parameters, that this variant began with. */
  get isValid(): boolean {
    return this.base === baseOf(this.track) &&
      (this.track.kind !== 'watch' || this.history.size === 0 || this.track.history.size > 0);
  }

  /** Sequence of the track's frame at a position: in a watched stream, of the newest frame up to it. */
  frameAt(position: number): number {
    return this.track.kind === 'watch' ? this.track.entryAt(position)?.sequence ?? position : position;
  }

  /** The newest frame of this variant up to a position. */
  entryAt(position: number): Entry | null {
    return this.history.atOrBefore(position);
  }

  /** Why the frame at a position is not shown, or empty. */
  refusalOf(position: number): string {
    return this.problem || (this.refusals.get(this.frameAt(position)) ?? '');
  }

  drawn(entry: Entry, now: number): void {
    if (!Number.isNaN(entry.summary.latency)) return;
    entry.summary.latency = now - entry.receivedAt;
    this.counts.drawn++;
  }

  /** Called once per refresh of the screen, with the player's position. */
  refresh(position: number, now: number): void {
    const target = this.frameAt(position);
    if (target !== this.target) this.targetSince = now;
    this.target = target;
    if (!this.producer && now >= this.retryAt) this.start();
    const isBefore = target < this.first && !this.history.get(target);
    if (isBefore && now - this.targetSince >= REST_MS) this.restart();
    this.wakeSender?.();
  }

  close(): void {
    this.isClosed = true;
    this.stop();
  }

  private stop(): void {
    this.producer?.close();
    this.producer = null;
    this.wakeSender?.();
  }

  private restart(): void {
    this.stop();
    this.start();
  }

  private start(): void {
    if (this.isClosed) return;
    this.history.clear();
    this.refusals.clear();
    this.sent = [];
    const available = this.track.kind === 'watch' ? this.track.history.first?.sequence ?? this.target : 1;
    this.first = firstOf(this.target, available);
    this.last = this.first - 1;
    this.retryAt = Infinity;  // Until the stream has ended.
    void this.open();
  }

  private async open(): Promise<void> {
    const { first } = this;
    try {
      const [{ capabilities }, particles] = await Promise.all([this.gateway.info(), this.track.particlesOf(first)]);
      if (this.isClosed || this.producer || first !== this.first) return;
      if (!particles) {
        this.fail(NO_PARTICLES);
        return;
      }
      const attributes = capabilities.includes('attributes') ? (particles.scalars ?? []).map(({ name }) => name) : [];
      const spacing = this.track.entryAt(first)?.frame().statistics.spacing ?? null;
      const producer: Producer = new Producer(this.gateway, {
        parameters: this.parameters(spacing),
        outputs: outputsFor(attributes),
        labels: { from: 'viewer', role: 'variant' },
      }, {
        opened: (opened) => {
          this.streamId = opened.streamId;
          this.problem = '';
          this.backoff.reset();
        },
        next: () => this.next(producer),
        frame: (asked, frame, message) => this.take(this.sent[asked - 1], frame, message),
        error: (asked, message) => {
          const sequence = this.sent[asked - 1];
          this.refusals.set(sequence, `Frame ${this.labelOf(sequence)} is refused: ${sentence(message)}`);
        },
        ended: (status) => { if (producer === this.producer) this.ended(status); },
      });
      this.producer = producer;
    } catch (error) {
      if (error instanceof CallError) this.ended(error.status);
      else if (error instanceof InputError) this.fail(error.message);
      else throw error;
    }
  }

  private fail(problem: string): void {
    this.problem = problem;
    this.retryAt = Infinity;
  }

  private ended(status: CallStatus): void {
    this.producer = null;
    if (status.code !== 0) this.problem = describe(status);
    this.retryAt = status.code === 0 || mayRetry(status) ? performance.now() + this.backoff.take() : Infinity;
  }

  /** Waits for the next frame of the track and for capacity for its result. */
  private async next(producer: Producer): Promise<Particles | null> {
    while (producer === this.producer) {
      const sequence = this.nextSequence();
      if (sequence !== null) {
        this.last = sequence;
        const particles = await this.track.particlesOf(sequence);
        if (!particles) {
          this.fail(NO_PARTICLES);
          return null;
        }
        this.sent.push(sequence);
        return shareOf(particles, this.settings.share);
      }
      await new Promise<void>((wake) => { this.wakeSender = wake; });
    }
    return null;
  }

  private nextSequence(): number | null {
    const { track, last, target } = this;
    const end = track.range()?.last ?? 0;
    const next = track.kind === 'watch' ? nextOf(track.history, last, target) : last < end ? last + 1 : null;
    return next !== null && hasCapacityFor(this.history, next, target) ? next : null;
  }

  private take(sequence: number, result: ReconstructedFrame, message: Uint8Array): void {
    this.counts.received++;
    const frame = () => ({
      ...decodeFrame(parseResult(message), this.track.parameters?.plane ?? 0), sequence: BigInt(sequence),
    });
    this.history.insert({
      sequence, time: result.time, receivedAt: performance.now(), bytes: message.length,
      summary: summarise(result, this.counts), frame,
    }, Math.max(1, this.target - KEPT_BEHIND));
  }

  private parameters(spacing: number | null = null) {
    return parametersOf(this.settings, this.track.parameters, spacing);
  }

  /** The particles used, relative to `origin`: the server does not return them. */
  async drawnParticles(sequence: number, origin: [number, number]) {
    const particles = await this.track.particlesOf(sequence);
    if (!particles) return null;
    const used = shareOf(particles, this.settings.share);
    return {
      points: relativePositions(used.positionFormat, used.positions, this.track.parameters?.plane ?? 0, origin),
      sizes: particleSizes(used, this.parameters()),
      attributes: particleChannels(used),
    };
  }
}

function baseOf({ parameters }: Track): string {
  return parameters ? toBinary(ReconstructionParametersSchema, parameters).join() : '';
}
