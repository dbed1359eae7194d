import { create } from '@bufbuild/protobuf';
import { Boundary, Fill, Placement, ReconstructionParametersSchema, Sizes } from '@proto/v1/reconstruction_pb';
import assert from 'node:assert/strict';
import test from 'node:test';
import { digestText } from '../src/protocol/digest';
import { Backoff } from '../src/stream/backoff';
import { Credit, FIRST_CREDITS } from '../src/stream/credit';
import { AS_STREAMED, isAsStreamed, parametersOf, parseSettings, parseWalls, settingsText } from '../src/stream/settings';
import { describe, mayRetry, parseStatus } from '../src/stream/status';
import { addressText, parseAddress } from '../src/ui/address';
import { count, number } from '../src/ui/format';

test('settings survive the address', () => {
  const settings = { ...AS_STREAMED, placement: Placement.QEF, fill: Fill.NONE, kernelRadius: 2.5, share: 50 };
  assert.equal(settingsText(settings), 'placement:qef;fill:none;kernel:2.5;share:50');
  assert.deepEqual(parseSettings(settingsText(settings)), settings);
  assert.ok(isAsStreamed(parseSettings('')));
  assert.deepEqual(parseSettings('placement:nonsense;share:7;kernel:x'), AS_STREAMED);
});

test('an address holds streams, frame, view, settings and look', () => {
  const address = {
    panes: [{ stream: 'dam', settings: { ...AS_STREAMED } },
            { stream: '', settings: { ...AS_STREAMED, fill: Fill.GRID } },
            { stream: 'other~1', settings: { ...AS_STREAMED } }],
    file: '', open: '',
    frame: 12, view: { x: 1.5, y: -2, scale: 300 }, look: 'outline,colour:p & q,width:2',
    camera: { target: [1, -2, 3.5] as const, turn: -1.05, tilt: 0.4, height: 12 }, space: 'flat,clip:x:0.25:flipped',
  };
  const text = addressText(address);
  assert.match(text, /^#stream=dam&frame=12&view=1\.5,-2,300&camera=1,-2,3\.5,-1\.05,0\.4,12&beside=~fill:grid&/);
  const back = parseAddress(text);
  assert.deepEqual([back.camera, back.space], [address.camera, address.space]);
  assert.deepEqual([back.frame, back.view, back.look], [12, address.view, address.look]);
  assert.deepEqual(back.panes.slice(0, 2), address.panes.slice(0, 2));
});

test('an address holds a file by its name', () => {
  const address = {
    panes: [{ stream: '', settings: { ...AS_STREAMED, fill: Fill.GRID } }, { stream: 'dam', settings: { ...AS_STREAMED } }],
    file: 'drops 1.csv', open: '', frame: 0, view: null, look: '', camera: null, space: '',
  };
  const text = addressText(address);
  assert.equal(text, '#file=drops%201.csv&frame=0&set=fill:grid&beside=dam~');
  assert.deepEqual(parseAddress(text), address);
});

test('an invalid address shows nothing', () => {
  for (const hash of ['', '#', '#frame=x&view=1,2', '#beside=~fill:grid']) {
    const address = parseAddress(hash);
    assert.deepEqual([address.panes, address.frame, address.view], [[], null, null]);
  }
});

test('another placement gets its own reference radius', () => {
  const base = create(ReconstructionParametersSchema, {
    placement: Placement.VIRTUAL_PLANE, kernelRadius: 3, referenceRadius: 0.7, cellSize: 1, clean: true,
    attributeTolerance: 0.1,
  });
  const other = parametersOf({ ...AS_STREAMED, placement: Placement.QEF }, base, 0.1);
  assert.deepEqual([other.placement, other.referenceRadius, other.clean, other.spacing],
                   [Placement.QEF, undefined, undefined, 0.1]);
  const same = parametersOf({ ...AS_STREAMED, cellSize: 2 }, base, null);
  assert.deepEqual([same.referenceRadius, same.cellSize, same.kernelRadius, same.attributeTolerance],
                   [0.7, 2, 3, 0.1]);
  assert.equal(parametersOf({ ...AS_STREAMED, surfaceOffset: 0.5 }, base, null).surfaceOffset, undefined);
});

test('another placement has the same periodic box', () => {
  const base = create(ReconstructionParametersSchema, {
    placement: Placement.VIRTUAL_PLANE, box: { x: { origin: 1, length: 40 }, wraps: true },
  });
  const boxOf = (placement: Placement) => parametersOf({ ...AS_STREAMED, placement }, base, 1).box;
  assert.deepEqual([boxOf(Placement.QEF)?.x?.length, boxOf(Placement.QEF)?.wraps], [40, true]);
  assert.equal(boxOf(Placement.FARTHEST_PARTICLE)?.wraps, false);
  assert.equal(parametersOf(AS_STREAMED, null, 1).box, undefined);
});

test('only the placement that is cut at walls keeps them', () => {
  const base = create(ReconstructionParametersSchema, {
    placement: Placement.VIRTUAL_PLANE, walls: [{ points: [0, 0, 1, 0] }],
  });
  const wallsOf = (placement: Placement) => parametersOf({ ...AS_STREAMED, placement }, base, 1).walls;
  assert.deepEqual(wallsOf(Placement.UNSPECIFIED).map(({ points }) => points), [[0, 0, 1, 0]]);
  assert.equal(wallsOf(Placement.VIRTUAL_PLANE).length, 1);
  assert.deepEqual(wallsOf(Placement.QEF), []);
});

test('walls and sizes of the settings replace those of the stream', () => {
  const base = create(ReconstructionParametersSchema, { walls: [{ points: [0, 0, 1, 0] }], sizes: Sizes.OWN });
  const chosen = { ...AS_STREAMED, walls: [[0, -1, 2.5, -1], [0, 0, 4, 0, 4, 3]], sizes: 'grains' };
  const text = settingsText(chosen);
  assert.equal(text, 'sizes:grains;walls:0,-1,2.5,-1/0,0,4,0,4,3');
  assert.deepEqual(parseSettings(text), chosen);
  const parameters = parametersOf(chosen, base, 1);
  assert.deepEqual(parameters.walls.map(({ points }) => points), chosen.walls);
  assert.deepEqual([parameters.sizes, parameters.boundary], [Sizes.OWN, Boundary.GRAINS]);
  assert.equal(parametersOf({ ...AS_STREAMED, sizes: 'equal' }, base, 1).sizes, Sizes.EQUAL);
  assert.equal(parametersOf(AS_STREAMED, base, 1).sizes, Sizes.OWN);
  for (const wrong of ['1,2,3', '1,2,3,4,5', '1,2,3,x', '1,2', '1,2,3,0x10', '0,0,1,', '0,0,1,1e61', '0,0,1,1e-61']) assert.throws(() => parseWalls(wrong), /two points or more/);
  assert.equal(parseWalls('  '), null);
  assert.deepEqual(parseWalls('-1e60,0,.5,1e39'), [[-1e60, 0, 0.5, 1e39]]);
  assert.deepEqual(parseSettings('kernel:0x3;cell: 1'), AS_STREAMED);
  assert.deepEqual(parseSettings('walls:1,2;sizes:large'), AS_STREAMED);
});

test('a status becomes a sentence with a remedy', () => {
  const status = parseStatus('{"code": 5, "reason": "NO_SUCH_STREAM", "message": "stream_name: dam; no open stream has it"}');
  assert.ok(status);
  assert.match(describe(status), /^stream_name: dam; no open stream has it\.$/);
  assert.ok(mayRetry(status));
  assert.equal(parseStatus('<html>'), null);
  assert.equal(parseStatus('{}'), null);
  assert.ok(!mayRetry({ code: 16, reason: 'TOKEN_UNKNOWN', message: '' }));
});

test('pauses grow to a limit and reset after a success', () => {
  const backoff = new Backoff(200, 1000);
  assert.deepEqual([1, 2, 3, 4].map(() => backoff.take()), [200, 400, 800, 1000]);
  backoff.reset();
  assert.equal(backoff.take(), 200);
});

/** Fewest and most frames in flight, from the server's view, and messages, for 128 frames of this size after the first 100. */
function inFlight(bytes: number): { fewest: number; most: number; messages: number } {
  const credit = new Credit();
  let allowed = FIRST_CREDITS;
  const seen: number[] = [];
  let messages = 0;
  for (let k = 0; k < 228; ++k) {
    const more = credit.taken(bytes);
    allowed += more - 1;
    if (k < 100) continue;
    seen.push(allowed);
    if (more > 0) ++messages;
  }
  return { fewest: Math.min(...seen), most: Math.max(...seen), messages };
}

test('small frames get more credit than large ones', () => {
  assert.equal(inFlight(1000).most, 64);
  assert.equal(inFlight(1 << 20).most, 8);
  assert.equal(inFlight(50 << 20).most, 4);
});

test('credits come in batches of a quarter of the frames in flight', () => {
  assert.deepEqual(inFlight(1000), { fewest: 49, most: 64, messages: 8 });
  assert.deepEqual(inFlight(1 << 20), { fewest: 7, most: 8, messages: 64 });
  assert.deepEqual(inFlight(50 << 20), { fewest: 4, most: 4, messages: 128 });
});

test('numbers are short and digests have sixteen digits', () => {
  assert.deepEqual([number(1.23456789), number(0), number(NaN), number(1e9), number(12345678, 3)],
                   ['1.2346', '0', '–', '1e+9', '1.23e+7']);
  assert.equal(count(1234567), '1,234,567');
  assert.equal(digestText(0xabn), '00000000000000ab');
});
