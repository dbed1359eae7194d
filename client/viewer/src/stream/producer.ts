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
  /** Frame `sequence` of the stream, from 1 on; null ends the stream. */
  next(sequence: number): Promise<Particles | null>;
  frame(frame: ReconstructedFrame, message: Uint8Array): void;
  error(error: FrameError): void;
  ended(status: CallStatus): void;
}

/** The result in a message of a producer's stream that holds one. */
export function parseResult(message: Uint8Array): ReconstructedFrame {
  const { response } = fromBinary(ReconstructResponseSchema, message);
  if (response.case !== 'frame') throw new Error('a message without frame');
  return response.value;
}

/** One call of Reconstruct: sends frames as fast as their answers come. */
export class Producer {
  private readonly channel: Channel;
  private window = 0;
  private sent = 0;
  private answered = 0;
  private sending = false;
  private over = false;

  constructor(gateway: Gateway, open: MessageInitShape<typeof OpenStreamSchema>,
              private readonly events: ProducerEvents) {
    this.channel = gateway.open('/v1/reconstruct', {
      opened: () => this.channel.send(
        ReconstructRequestSchema, { request: { case: 'open', value: open } }),
      message: (bytes) => this.receive(bytes),
      ended: (status) => {
        this.over = true;
        events.ended(status);
      },
    });
  }

  close(): void {
    this.over = true;
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

  /** Fills the window; one at a time, as frames may take a while to read. */
  private async sendMore(): Promise<void> {
    if (this.sending) return;
    this.sending = true;
    while (!this.over && this.sent - this.answered < this.window) {
      const sequence = this.sent + 1;
      const frame = await this.events.next(sequence);
      if (this.over) break;
      if (!frame) {
        this.over = true;
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
