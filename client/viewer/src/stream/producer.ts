import { fromBinary, type MessageInitShape } from '@bufbuild/protobuf';
import {
  ReconstructRequestSchema, ReconstructResponseSchema, type OpenStreamSchema, type ReconstructedFrame, type StreamOpened,
} from '@proto/v1/reconstruction_pb';
import type { Channel, Gateway } from './gateway';
import type { Particles } from '../protocol/particles';
import type { CallStatus } from './status';

/** Why a frame with a box is not sent to a server that ignores it. */
export const NO_FRAME_BOXES = 'frame.box requires a server with the capability frame-boxes: use a newer one';

/** `sequence` of results and errors: as given to `next`. */
export interface ProducerEvents {
  opened(opened: StreamOpened): void;
  /** Provides frame `sequence`, starting at 1. Null ends the stream. */
  next(sequence: number): Promise<Particles | null>;
  frame(sequence: number, frame: ReconstructedFrame, message: Uint8Array): void;
  error(sequence: number, message: string): void;
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
  private usesFrameBoxes = false;
  private asked = 0;
  /** Frames sent: frame k of the call is `next(sent[k - 1])`. */
  private readonly sent: number[] = [];
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
      this.usesFrameBoxes = response.value.frameBoxes;
      this.events.opened(response.value);
    } else if (response.case === 'frame') {
      this.answered++;
      this.events.frame(this.sent[Number(response.value.sequence) - 1], response.value, bytes);
    } else if (response.case === 'error') {
      this.answered++;
      this.events.error(this.sent[Number(response.value.sequence) - 1], response.value.message);
    }
    void this.sendMore();
  }

  /** Sends frames until the window is full. Refuses frames with a box that the server ignores. */
  private async sendMore(): Promise<void> {
    if (this.sending) return;
    this.sending = true;
    while (!this.isOver && this.sent.length - this.answered < this.window) {
      const sequence = ++this.asked;
      const frame = await this.events.next(sequence);
      if (this.isOver) break;
      if (!frame) {
        this.isOver = true;
        this.channel.halfClose();
        break;
      }
      if (frame.box && !this.usesFrameBoxes) {
        this.events.error(sequence, NO_FRAME_BOXES);
        continue;
      }
      this.sent.push(sequence);
      this.channel.send(ReconstructRequestSchema, {
        request: { case: 'frame', value: { ...frame, sequence: BigInt(this.sent.length) } },
      });
    }
    this.sending = false;
  }
}
