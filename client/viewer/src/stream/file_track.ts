import { Plane, type ReconstructedFrame, type ReconstructionParameters, type StreamOpened }
  from '@proto/v1/reconstruction_pb';
import { InputError, type FrameSource } from '../input/source';
import { shareOf } from '../input/share';
import { nearPlane } from '../input/space';
import { Backoff } from './backoff';
import type { Gateway } from './gateway';
import { History, type Entry } from './history';
import { Player, type Range } from './player';
import { Producer, parseResult } from './producer';
import { type Outline, outlinesOf } from '../protocol/sections';
import { methodOf, outputsFor, parametersOf, type Settings, withSource } from './settings';
import { decodeFrame, decodeSpaceFrame } from '../protocol/decode';
import type { Frame } from '../protocol/frame';
import { particleChannels, type Particles, particleSizes } from '../protocol/particles';
import { relativePositions } from '../protocol/positions';
import { CallError, describe, mayRetry, sentence, type CallStatus } from './status';
import { summarise, type Counts } from './summary';
import {
  type DrawnParticles, hasCapacityFor, HISTORY_BYTES, KEPT_BEHIND, type Method, type Track, type TrackState,
} from './track';

/** Frames per second at speed 1. */
const RATE = 30;

/**
 * Dropped files, sent to the server as a stream. Frame k of the source has the sequence k + 1. Users see
 * k, as in the results of `partiemc replay`.
 */
export class FileTrack implements Track {
  readonly kind = 'file';
  readonly history = new History(HISTORY_BYTES);
  readonly player: Player;
  readonly counts: Counts = { received: 0, drawn: 0, dropped: 0 };
  state: TrackState = { kind: 'busy', text: 'Connecting' };
  parameters: ReconstructionParameters | null = null;
  /** The server's id of the stream. */
  streamId = '';

  private readonly backoff = new Backoff();
  private producer: Producer | null = null;
  private retry: ReturnType<typeof setTimeout> | null = null;
  private wakeSender: (() => void) | null = null;
  /** Why frames are refused, by sequence. */
  private readonly refusals = new Map<number, string>();
  private hasAttributes = false;
  private attempt = 0;

  constructor(private readonly gateway: Gateway, private readonly source: FrameSource,
              public settings: Settings) {
    this.player = new Player(this, false);
    this.connect();
  }

  get title(): string { return this.source.title; }
  get method(): Method | null { return methodOf(this.parameters); }
  get bounds(): null { return null; }
  get notice(): string { return this.source.notice; }
  get outlines(): Outline[] { return outlinesOf(this.parameters); }

  range(): Range { return { first: 1, last: this.source.count }; }
  rate(): number { return RATE; }
  livePosition(): null { return null; }

  entryAt(sequence: number): Entry | null { return this.history.get(sequence); }
  labelOf(sequence: number): string { return String(sequence - 1); }
  sequenceOf(label: number): number { return label + 1; }
  refusalOf(sequence: number): string { return this.refusals.get(sequence) ?? ''; }
  doubtText(doubt: number): string { return this.gateway.doubtText(doubt); }

  async particlesOf(sequence: number): Promise<Particles> {
    const frame = await this.source.frame(sequence - 1);
    return this.hasAttributes ? frame : { ...frame, scalars: [] };
  }

  /** Reads the particles from the files, because the server does not return particles to their producer. */
  async drawnParticles(sequence: number, origin: [number, number]): Promise<DrawnParticles> {
    let particles = shareOf(await this.source.frame(sequence - 1), this.settings.share);
    const [plane] = this.source.slices;
    // The picture shows the particles within half a spacing of its plane.
    if (plane) particles = nearPlane(particles, plane, (this.source.spacing ?? 0) / 2);
    return {
      points: relativePositions(particles.positionFormat, particles.positions, 0, origin),
      sizes: particleSizes(particles, this.parameters),
      attributes: particleChannels(particles),
    };
  }

  reopen(settings: Settings): void {
    this.close();
    this.settings = settings;
    this.history.clear();
    this.refusals.clear();
    this.state = { kind: 'busy', text: 'Connecting' };
    this.connect();
  }

  refresh(): void {
    this.wakeSender?.();
  }

  close(): void {
    this.attempt++;
    this.producer?.close();
    this.producer = null;
    this.wakeSender?.();
    if (this.retry !== null) clearTimeout(this.retry);
  }

  /** Reads the server's capabilities, then opens the stream. Scalars are sent if the server supports attributes. */
  private connect(): void {
    const attempt = ++this.attempt;
    this.gateway.info()
      .then(({ capabilities }) => {
        this.hasAttributes = capabilities.includes('attributes');
        if (attempt === this.attempt) this.open();
      })
      .catch((error: unknown) => {
        if (!(error instanceof CallError)) throw error;
        if (attempt === this.attempt) this.ended(error.status);
      });
  }

  private decode(message: Uint8Array): Frame {
    const result = parseResult(message);
    return this.source.isSurface ? decodeSpaceFrame(result) : decodeFrame(result, Plane.UNSPECIFIED);
  }

  private open(): void {
    const producer: Producer = new Producer(this.gateway, {
      parameters: withSource(parametersOf(this.settings, null, this.source.spacing), this.source),
      outputs: outputsFor(this.hasAttributes ? this.source.scalars : [], this.source.isSurface),
      labels: { from: 'viewer' },
    }, {
      opened: (opened) => this.opened(opened),
      next: (sequence) => this.next(sequence, producer),
      frame: (sequence, frame, message) => this.frame(sequence, frame, message),
      error: (sequence, message) => {
        this.refusals.set(sequence, `Frame ${this.labelOf(sequence)} is refused: ${sentence(message)}`);
        this.answered(sequence);
      },
      ended: (status) => this.ended(status),
    });
    this.producer = producer;
  }

  private opened(opened: StreamOpened): void {
    if (this.source.box && !opened.parameters?.box) {
      this.close();
      this.state = { kind: 'failed', text: 'The server does not support periodic boxes: use a newer one.' };
      return;
    }
    this.parameters = opened.parameters ?? null;
    this.streamId = opened.streamId;
    this.backoff.reset();
    this.state = { kind: 'well', text: 'Streaming' };
  }

  /** Waits for capacity for the result, then reads the particles of the next frame. */
  private async next(sequence: number, producer: Producer): Promise<Particles | null> {
    if (sequence > this.source.count) return null;
    while (producer === this.producer && !hasCapacityFor(this.history, sequence, this.player.sequence ?? 1)) {
      await new Promise<void>((wake) => { this.wakeSender = wake; });
    }
    try {
      return shareOf(await this.particlesOf(sequence), this.settings.share);
    } catch (error) {
      if (!(error instanceof InputError)) throw error;
      this.state = { kind: 'failed', text: error.message };
      return null;
    }
  }

  private frame(sequence: number, frame: ReconstructedFrame, message: Uint8Array): void {
    this.counts.received++;
    this.history.insert({
      sequence,
      time: frame.time,
      receivedAt: performance.now(),
      bytes: message.length,
      summary: summarise(frame, this.counts),
      frame: () => ({
        ...this.decode(message), sequence: BigInt(sequence),
      }),
    }, Math.max(1, (this.player.sequence ?? 1) - KEPT_BEHIND));
    this.answered(sequence);
  }

  private answered(sequence: number): void {
    if (sequence !== this.source.count || this.state.kind !== 'well') return;
    const { size } = this.refusals;
    this.state = { kind: 'well', text: `All frames received${size > 0 ? `, ${size} refused` : ''}` };
  }

  private ended(status: CallStatus): void {
    this.producer = null;
    this.wakeSender?.();
    if (status.code === 0) return;
    if (!mayRetry(status)) {
      this.state = { kind: 'failed', text: describe(status) };
      return;
    }
    this.state = { kind: 'lost', text: `${describe(status)} Trying again.` };
    this.retry = setTimeout(() => this.connect(), this.backoff.take());
  }
}
