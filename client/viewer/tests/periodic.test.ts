import { create, fromBinary, type MessageInitShape, toBinary } from '@bufbuild/protobuf';
import {
  type PeriodicBox, PeriodicBoxSchema, PositionFormat, ReconstructRequestSchema, ReconstructResponseSchema,
} from '@proto/v1/reconstruction_pb';
import assert from 'node:assert/strict';
import test from 'node:test';
import { inspectFiles } from '../src/input/drop';
import { FieldError, type FileOptions, NO_OPTIONS } from '../src/input/options';
import { InputError } from '../src/input/source';
import { bytesOf } from '../src/protocol/arrays';
import { FileTrack } from '../src/stream/file_track';
import type { ChannelEvents, Gateway } from '../src/stream/gateway';
import { NO_FRAME_BOXES, Producer } from '../src/stream/producer';
import { AS_STREAMED } from '../src/stream/settings';
import type { Track } from '../src/stream/track';
import { Variant } from '../src/stream/variant';
import { openDropped, recordingOf } from './open_dropped';

const options = (given: Partial<FileOptions>) => ({ ...NO_OPTIONS, ...given });
/** Origin and length along x, y, z. */
const numbersOf = (box: PeriodicBox | undefined) =>
  box && [box.x, box.y, box.z].map((axis) => axis ? [axis.origin, axis.length] : null);

/** A frame of a LAMMPS dump with two atoms in the box from -1 to `high` along all axes. */
const frameOf = (high: number, flags = 'pp pp pp', atoms = '1 .5 .25 0\n2 .25 .5 0', bounds = `-1 ${high}`) =>
  `ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ${flags}\n${bounds}\n${bounds}\n${bounds}\n` +
  `ITEM: ATOMS id x y z\n${atoms}\n`;
const dumpOf = (...frames: string[]) => new File(frames, 'npt.lammpstrj');

test('frames of a dump have a box if it differs from the first', async () => {
  const dump = dumpOf(frameOf(9), frameOf(9), frameOf(10.5));
  assert.ok((await inspectFiles([dump])).facts.hasBox);
  const source = await openDropped([dump], options({ periodic: 'x, y' }));
  assert.deepEqual(numbersOf(source.box), [[-1, 10], [-1, 10], null]);
  const boxes = await Promise.all([0, 1, 2].map(async (k) => numbersOf((await source.frame(k)).box)));
  assert.deepEqual(boxes, [undefined, undefined, [[-1, 11.5], [-1, 11.5], null]]);
  const open = await openDropped([dump]);
  assert.deepEqual([open.box, (await open.frame(2)).box], [undefined, undefined]);
});

test('a box has the axes of the picture, in space all three', async () => {
  const upright = dumpOf(frameOf(9, 'pp ff pp', '1 .5 0 .5\n2 .25 0 .25', '-1 9'));
  assert.deepEqual(numbersOf((await openDropped([upright], options({ periodic: 'y' }))).box), [null, [-1, 10], null]);
  const solid = dumpOf(frameOf(9, 'pp pp pp', '1 0 0 0\n2 3 4 5'), frameOf(8, 'pp pp pp', '1 0 0 0\n2 3 4 5'));
  const source = await openDropped([solid], options({ periodic: 'x,z', slice: 'surface', spacing: '1' }));
  assert.deepEqual(numbersOf(source.box), [[-1, 10], null, [-1, 10]]);
  assert.deepEqual(numbersOf((await source.frame(1)).box), [[-1, 9], null, [-1, 9]]);
});

test('the lattice of extended XYZ is a box', async () => {
  const xyz = (comment: string) => new File([`2\n${comment}\nA .5 .25 0\nA .25 .5 0\n`], 'a.xyz');
  const lattice = 'Lattice="10 1e-15 0 0 9 0 0 0 1"';
  assert.ok((await inspectFiles([xyz(lattice)])).facts.hasBox);
  const boxOf = async (comment: string) => numbersOf((await openDropped([xyz(comment)], options({ periodic: 'x,y' }))).box);
  assert.deepEqual(await boxOf(lattice), [[0, 10], [0, 9], null]);
  assert.deepEqual(await boxOf(`pbc="T T F" Origin="-1 2 0" ${lattice}`), [[-1, 10], [2, 9], null]);
  await assert.rejects(boxOf(`${lattice} pbc="F T F"`), /no periodic boundary along x/);
  await assert.rejects(boxOf('Lattice="10 0 0 1 9 0 0 0 1"'), /triclinic/);
  await assert.rejects(boxOf('Lattice="10 0 0"'), /has no box/);
});

test('boxes that do not fit are refused', async () => {
  const refused = (dump: File, periodic: string, text: RegExp) => assert.rejects(openDropped([dump], options({ periodic })),
    (error) => error instanceof FieldError && error.field === 'periodic' && text.test(error.message));
  await refused(dumpOf(frameOf(9)), 'u', /for example x,y/);
  await refused(dumpOf(frameOf(9)), 'z', /z requires a surface/);
  await refused(dumpOf(frameOf(9, 'pp ff pp')), 'x,y', /no periodic boundary along y/);
  await refused(dumpOf(frameOf(9, '')), 'x', /no periodic boundary along x/);
  await refused(dumpOf(frameOf(9, 'xy xz yz pp pp pp', undefined, '-1 9 2')), 'x', /triclinic/);
  await refused(new File(['x,y\n0,1\n'], 'a.csv'), 'x', /a\.csv has no box/);
  const upright = await openDropped([dumpOf(frameOf(9, 'xy xz yz pp pp pp', undefined, '-1 9 0'))], options({ periodic: 'x' }));
  assert.deepEqual(numbersOf(upright.box), [[-1, 10], null, null]);
  const later = await openDropped([dumpOf(frameOf(9), frameOf(9, 'ff pp pp'))], options({ periodic: 'x' }));
  await assert.rejects(later.frame(1), /frame 2 has no periodic boundary along x/);
});

test('frames of a recording have the recorded boxes', async () => {
  const frame = (length: number, origin = 0) => ({
    positionFormat: PositionFormat.FLOAT32_2, positions: bytesOf(Float32Array.of(0, 0, 1, 0)),
    box: { x: { origin, length }, y: { origin, length } },
  });
  const made = recordingOf(frame(10), frame(10), frame(11), { ...frame(11), box: undefined });
  assert.ok((await inspectFiles([made])).facts.hasBox);
  const source = await openDropped([made], options({ periodic: 'x' }));
  assert.deepEqual(numbersOf(source.box), [[0, 10], null, null]);
  assert.equal((await source.frame(1)).box, undefined);
  assert.deepEqual(numbersOf((await source.frame(2)).box), [[0, 11], null, null]);
  await assert.rejects(source.frame(3), /frame 3, has no box/);
  assert.equal((await (await openDropped([made])).frame(2)).box, undefined);
  for (const damaged of [frame(0), frame(NaN), frame(1, Infinity)]) {
    await assert.rejects(openDropped([recordingOf(damaged)]),
      (error) => error instanceof InputError && /a length of the box is not positive and finite/.test(error.message));
  }
});

/** Sends four frames, the second and the last with a box, to a server. Returns the events and the messages sent. */
async function sentTo(server: { frameBoxes: boolean }) {
  const sent: (readonly [bigint, number | undefined])[] = [];
  const seen: string[] = [];
  let events: ChannelEvents | undefined;
  const answer = (response: MessageInitShape<typeof ReconstructResponseSchema>['response']) =>
    events?.message(toBinary(ReconstructResponseSchema, create(ReconstructResponseSchema, { response })));
  const ended = new Promise<void>((end) => {
    const gateway = { open: (_: string, given: ChannelEvents) => {
      events = given;
      return {
        send: (schema: typeof ReconstructRequestSchema, message: MessageInitShape<typeof ReconstructRequestSchema>) => {
          const { request } = fromBinary(schema, toBinary(schema, create(schema, message)));
          if (request.case !== 'frame') return;
          sent.push([request.value.sequence, request.value.box?.x?.length]);
          queueMicrotask(() => answer({ case: 'frame', value: { sequence: request.value.sequence } }));
        },
        halfClose: end,
      };
    } } as unknown as Gateway;
    new Producer(gateway, {}, {
      opened: () => {},
      next: async (k) => k > 4 ? null : {
        time: k, positionFormat: PositionFormat.FLOAT32_2, positions: new Uint8Array(0),
        box: k % 2 === 0 ? create(PeriodicBoxSchema, { x: { length: k } }) : undefined,
      },
      frame: (sequence) => seen.push(`frame ${sequence}`),
      error: (sequence, message) => seen.push(`error ${sequence}: ${message}`),
      ended: () => {},
    });
  });
  answer({ case: 'opened', value: { framesInFlight: 1, ...server } });
  await ended;
  return { sent, seen };
}

test('a server that ignores boxes of frames gets none', async () => {
  assert.deepEqual(await sentTo({ frameBoxes: true }), {
    sent: [[1n, undefined], [2n, 2], [3n, undefined], [4n, 4]], seen: ['frame 1', 'frame 2', 'frame 3', 'frame 4'],
  });
  assert.deepEqual(await sentTo({ frameBoxes: false }), {
    sent: [[1n, undefined], [2n, undefined]],
    seen: ['frame 1', `error 2: ${NO_FRAME_BOXES}`, 'frame 3', `error 4: ${NO_FRAME_BOXES}`],
  });
});

/** Requests a frame with a box alone. Returns the lengths sent along x, and the error. */
async function requestedFrom(capabilities: string[]) {
  const sent: (number | undefined)[] = [];
  const gateway = {
    info: async () => ({ capabilities }),
    call: async (_: string, __: unknown, ___: unknown, { frame }: { frame: { box?: PeriodicBox } }) => {
      sent.push(frame.box?.x?.length);
      return {};
    },
  } as unknown as Gateway;
  const frame = { positionFormat: PositionFormat.FLOAT32_2, positions: new Uint8Array(0), box: create(PeriodicBoxSchema, { x: { length: 7 } }) };
  const track = { title: '', parameters: null, entryAt: () => null, particlesOf: async () => frame } as unknown as Track;
  const problem = await new Promise<string>((changed) => {
    const variant = new Variant(gateway, () => changed(variant.problem));
    variant.request(track, 1, AS_STREAMED);
  });
  return { sent, problem };
}

test('a frame requested alone has its box, if the server uses it', async () => {
  assert.deepEqual((await requestedFrom(['frame-boxes'])).sent, [7]);
  assert.deepEqual(await requestedFrom([]), { sent: [], problem: `${NO_FRAME_BOXES}.` });
});

test('a server without periodic boxes gets no periodic file', async () => {
  const source = await openDropped([dumpOf(frameOf(9))], options({ periodic: 'x' }));
  for (const hasBoxes of [true, false]) {
    let length: number | undefined;
    const track = await new Promise<FileTrack>((opened) => {
      const file: FileTrack = new FileTrack({
        info: async () => ({ capabilities: [] }),
        open: (_: string, events: ChannelEvents) => {
          queueMicrotask(() => {
            events.opened();
            events.message(toBinary(ReconstructResponseSchema, create(ReconstructResponseSchema, {
              response: { case: 'opened', value: { parameters: hasBoxes ? { box: { x: { origin: -1, length: 10 } } } : {} } },
            })));
            opened(file);
          });
          const send = (_: unknown, { request }: MessageInitShape<typeof ReconstructRequestSchema>) => {
            if (request?.case === 'open') length = request.value.parameters?.box?.x?.length;
          };
          return { send, halfClose: () => {}, close: () => {} };
        },
      } as unknown as Gateway, source, AS_STREAMED);
    });
    assert.equal(length, 10);
    assert.equal(track.state.kind, hasBoxes ? 'well' : 'failed');
    track.close();
  }
});
