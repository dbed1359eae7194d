import { fromBinary, type MessageInitShape } from '@bufbuild/protobuf';
import {
  ReconstructRequestSchema, ReconstructResponseSchema, type FrameError, type OpenStreamSchema,
  type ReconstructedFrame, type StreamOpened,
} from '@proto/v1/reconstruction_pb';
import type { Channel, Gateway } from './gateway';
import type { Particles } from '../protocol/particles';
import type { CallStatus } from './status';

export interface ProducerEvents {
  opened(opened: StreamOpened): void;
  /** Provides frame `sequence`, starting at 1. Null ends the stream. */
  next(sequence: number): Promise<Particles | null>;
  frame(frame: ReconstructedFrame, message: Uint8Array): void;
  error(error: FrameError): void;
  ended(status: CallStatus): void;
}

/** Parses a message that contains a result. */
export function parseResult(message: Uint8Array): ReconstructedFrame {
  const { response } = fromBinary(ReconstructResponseSchema, message);
  if (response.case !== 'frame') throw new Error('message without frame');
  return response.value;
}

/** One call of Reconstruct. Sends frames at the rate of their results. */
export class Producer {
  private readonly channel: Channel;
  private window = 0;
  private sent = 0;
  private answered = 0;
  private sending = false;
  private isOver = false;

  constructor(gateway: Gateway, open: MessageInitShape<typeof OpenStreamSchema>,
              private readonly events: ProducerEvents) {
    this.channel = gateway.open('/v1/reconstruct', {
      opened: () => this.channel.send(
        ReconstructRequestSchema, { request: { case: 'open', value: open } }),
      message: (bytes) => this.receive(bytes),
      ended: (status) => {
        this.isOver = true;
        events.ended(status);
      },
    });
  }

  close(): void {
    this.isOver = true;
    this.channel.close();
  }

  private receive(bytes: Uint8Array): void {
    const { response } = fromBinary(ReconstructResponseSchema, bytes);
    if (response.case === 'opened') {
      this.window = response.value.framesInFlight;
      this.events.opened(response.value);
    } else if (response.case === 'frame') {
      this.answered++;
      this.events.frame(response.value, bytes);
    } else if (response.case === 'error') {
      this.answered++;
      this.events.error(response.value);
    }
    void this.sendMore();
  }

  /** Sends frames until the window is full. */
  private async sendMore(): Promise<void> {
    if (this.sending) return;
    this.sending = true;
    while (!this.isOver && this.sent - this.answered < this.window) {
      const sequence = this.sent + 1;
      const frame = await this.events.next(sequence);
      if (this.isOver) break;
      if (!frame) {
        this.isOver = true;
        this.channel.halfClose();
        break;
      }
      this.sent = sequence;
      this.channel.send(ReconstructRequestSchema, {
        request: { case: 'frame', value: { ...frame, sequence: BigInt(sequence) } },
      });
    }
    this.sending = false;
  }
}
