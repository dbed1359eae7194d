import { fromBinary } from '@bufbuild/protobuf';
import {
  type WatchMode, WatchStreamRequestSchema, WatchStreamResponseSchema, type ReconstructedFrame,
  type WatchEnded, type WatchOpened, type WatchedFrame,
} from '@proto/v1/reconstruction_pb';
import { Credit, FIRST_CREDITS } from './credit';
import type { Channel, Gateway } from './gateway';
import type { CallStatus } from './status';

export interface WatchEvents {
  opened(opened: WatchOpened): void;
  /** The receiver closes the call if it cannot keep the frame. */
  frame(frame: WatchedFrame, message: Uint8Array): void;
  /** `end`: the server's message on the end of the stream, if it sent one. */
  ended(status: CallStatus, end: WatchEnded | null): void;
}

/** Parses a message that contains a frame. */
export function parseWatchedFrame(message: Uint8Array): ReconstructedFrame {
  const { response } = fromBinary(WatchStreamResponseSchema, message);
  if (response.case !== 'frame' || !response.value.frame) throw new Error('message without frame');
  return response.value.frame;
}

/** One call of WatchStream. */
export class WatchCall {
  private readonly channel: Channel;
  private readonly credit = new Credit();
  private end: WatchEnded | null = null;

  /** `from`: the first frame to send from the server's history; null: new frames only. */
  constructor(gateway: Gateway, stream: string, from: number | null, mode: WatchMode,
              private readonly events: WatchEvents) {
    this.channel = gateway.open('/v1/watch', {
      opened: () => this.channel.send(WatchStreamRequestSchema, {
        request: {
          case: 'open',
          value: {
            streamName: stream,
            mode,
            credits: FIRST_CREDITS,
            fromSequence: from === null ? undefined : BigInt(from),
          },
        },
      }),
      message: (bytes) => this.receive(bytes),
      ended: (status) => events.ended(status, this.end),
    });
  }

  close(): void {
    this.channel.close();
  }

  private receive(bytes: Uint8Array): void {
    const { response } = fromBinary(WatchStreamResponseSchema, bytes);
    if (response.case === 'opened') this.events.opened(response.value);
    if (response.case === 'ended') this.end = response.value;
    if (response.case !== 'frame') return;
    this.events.frame(response.value, bytes);
    this.allow(bytes.length);
  }

  private allow(bytes: number): void {
    const frames = this.credit.taken(bytes);
    if (frames > 0) {
      this.channel.send(WatchStreamRequestSchema, { request: { case: 'credit', value: { frames } } });
    }
  }
}
