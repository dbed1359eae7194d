import type { Plane, ReconstructedFrame, ReconstructionParameters, StreamOpened }
  from '@proto/v1/reconstruction_pb';
import { InputError, type FrameSource } from '../input/source';
import { shareOf } from '../input/share';
import { Backoff } from './backoff';
import type { Gateway } from './gateway';
import { History, type Entry } from './history';
import { Player, type Range } from './player';
import { Producer, parseResult } from './producer';
import { outputsFor, parametersOf, type Settings } from './settings';
import type { Particles } from '../protocol/particles';
import { CallError, inWords, mayTryAgain, type CallStatus } from './status';
import { summarise, type Counts } from './summary';
import { HISTORY_BYTES, type Track, type TrackState } from './track';

/** Frames a second at speed 1. */
const RATE = 30;
/** Frames before the player's place that are kept where results take more than there is room for. */
const KEPT_BEHIND = 8;

/** Files that were dropped on the page: a stream of their own through the server. Frame k of the
 * source has the sequence k + 1. */
export class FileTrack implements Track {
  readonly kind = 'file';
  readonly history = new History(HISTORY_BYTES);
  readonly player: Player;
  readonly counts: Counts = { received: 0, drawn: 0, dropped: 0 };
  state: TrackState = { kind: 'busy', words: 'Connecting' };
  parameters: ReconstructionParameters | null = null;
  /** What the server calls the stream. */
  streamId = '';

  private readonly backoff = new Backoff();
  private producer: Producer | null = null;
  private retry: ReturnType<typeof setTimeout> | null = null;
  private wakeSender: (() => void) | null = null;
  private refused = '';
  private hasAttributes = false;
  private attempt = 0;

  constructor(private readonly gateway: Gateway, private readonly source: FrameSource,
              public settings: Settings) {
    this.player = new Player(this, false);
    this.connect();
  }

  get title(): string { return this.source.title; }
  get plane(): Plane { return 0; }

  range(): Range { return { first: 1, last: this.source.count }; }
  rate(): number { return RATE; }
  livePosition(): null { return null; }

  entryAt(sequence: number): Entry | null { return this.history.get(sequence); }

  async particlesOf(sequence: number): Promise<Particles> {
    const frame = await this.source.frame(sequence - 1);
    return this.hasAttributes ? frame : { ...frame, scalars: [] };
  }

  reopen(settings: Settings): void {
    this.close();
    this.settings = settings;
    this.history.clear();
    this.refused = '';
    this.connect();
  }

  moved(): void {
    this.wakeSender?.();
  }

  close(): void {
    this.attempt++;
    this.producer?.close();
    this.producer = null;
    this.wakeSender?.();
    if (this.retry !== null) clearTimeout(this.retry);
  }

  /** Scalars go along where the server can colour by them. */
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

  private open(): void {
    const producer: Producer = new Producer(this.gateway, {
      parameters: parametersOf(this.settings, null, this.source.spacing),
      outputs: outputsFor(this.hasAttributes ? this.source.scalars : []),
      labels: { from: 'viewer' },
    }, {
      opened: (opened) => this.opened(opened),
      next: (sequence) => this.next(sequence, producer),
      frame: (frame, message) => this.frame(frame, message),
      error: (error) => {
        this.refused = `Frame ${error.sequence} is refused: ${error.message}.`;
        this.state = { kind: 'failed', words: this.refused };
      },
      ended: (status) => this.ended(status),
    });
    this.producer = producer;
  }

  private opened(opened: StreamOpened): void {
    this.parameters = opened.parameters ?? null;
    this.streamId = opened.streamId;
    this.backoff.reset();
    this.state = { kind: 'well', words: 'Streaming' };
  }

  /** The particles of the frame to send next, once there is room for its result. */
  private async next(sequence: number, producer: Producer): Promise<Particles | null> {
    if (sequence > this.source.count) return null;
    while (producer === this.producer && !this.hasRoomFor(sequence)) {
      await new Promise<void>((wake) => { this.wakeSender = wake; });
    }
    try {
      return shareOf(await this.particlesOf(sequence), this.settings.share);
    } catch (error) {
      if (!(error instanceof InputError)) throw error;
      this.refused = error.message;
      this.state = { kind: 'failed', words: error.message };
      return null;
    }
  }

  private hasRoomFor(sequence: number): boolean {
    const first = this.history.first;
    if (!first || this.history.bytes < 0.9 * HISTORY_BYTES) return true;
    const place = this.player.sequence ?? 1;
    return first.sequence < place - KEPT_BEHIND || sequence <= place + 1;
  }

  private frame(frame: ReconstructedFrame, message: Uint8Array): void {
    this.counts.received++;
    const sequence = Number(frame.sequence);
    this.history.insert({
      sequence,
      time: frame.time,
      receivedAt: performance.now(),
      bytes: message.length,
      summary: summarise(frame, this.counts),
      parse: () => parseResult(message),
    }, Math.max(1, (this.player.sequence ?? 1) - KEPT_BEHIND));
    if (sequence === this.source.count && !this.refused) {
      this.state = { kind: 'well', words: 'All frames are here' };
    }
  }

  private ended(status: CallStatus): void {
    this.producer = null;
    this.wakeSender?.();
    if (status.code === 0) return;
    if (!mayTryAgain(status)) {
      this.state = { kind: 'failed', words: inWords(status) };
      return;
    }
    this.state = { kind: 'lost', words: `${inWords(status)} Trying again.` };
    this.retry = setTimeout(() => this.connect(), this.backoff.take());
  }
}
