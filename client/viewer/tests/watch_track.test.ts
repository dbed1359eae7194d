// A watched stream, with a gateway that stands in for the server's.
import { create, toBinary } from '@bufbuild/protobuf';
import { WatchStreamResponseSchema } from '@proto/v1/reconstruction_pb';
import assert from 'node:assert/strict';
import test from 'node:test';
import type { ChannelEvents, Gateway } from '../src/stream/gateway';
import { WatchTrack } from '../src/stream/watch_track';

test('the newest frame is parsed once, and earlier ones again', () => {
  let events: ChannelEvents | null = null;
  const gateway = {
    open: (_: string, given: ChannelEvents) => {
      events = given;
      return { send() {}, close() {} };
    },
    info: () => Promise.reject(new Error('unused')),
  };
  const track = new WatchTrack(gateway as unknown as Gateway, 'a');
  const receive = (sequence: bigint) => {
    const response = { case: 'frame', value: { frame: { sequence, time: Number(sequence) } } } as const;
    const message = toBinary(WatchStreamResponseSchema, create(WatchStreamResponseSchema, { response }));
    events?.message(message);
    return message;
  };
  const sequenceAt = (sequence: number) => track.entryAt(sequence)?.message().sequence;
  const first = receive(1n);
  const whole = first.slice();
  first.fill(0);  // Cannot be parsed again.
  assert.equal(sequenceAt(1), 1n);
  receive(2n);
  assert.throws(() => sequenceAt(1), 'one parsed frame is held');
  first.set(whole);
  assert.equal(sequenceAt(1), 1n);
  assert.equal(sequenceAt(2), 2n);
});
