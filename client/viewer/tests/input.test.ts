import { PositionFormat } from '@proto/v1/reconstruction_pb';
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import { planNamedColumns } from '../src/input/columns';
import { parseTimes } from '../src/input/csv';
import { openDropped } from '../src/input/drop';
import { LammpsSource, parseLammpsFrame } from '../src/input/lammps';
import { naturalOrder } from '../src/input/natural_order';
import { RecordingSource } from '../src/input/recording';
import { shareOf } from '../src/input/share';
import { InputError } from '../src/input/source';
import { parseTable } from '../src/input/table';
import { arrayOf, bytesOf } from '../src/protocol/arrays';
import type { Particles } from '../src/protocol/particles';

const doubles = (bytes: Uint8Array) => [...arrayOf(Float64Array, bytes)];
const recording = new URL('../../../recordings/dam_break.pemc', import.meta.url);

test('names are in natural order', () => {
  const names = ['f10.csv', 'f2.csv', 'f1.csv', 'a/f3.csv', 'f02.csv'];
  assert.deepEqual(names.sort(naturalOrder), ['a/f3.csv', 'f1.csv', 'f02.csv', 'f2.csv', 'f10.csv']);
});

test('tables may use any separator, quotes and comments', () => {
  assert.deepEqual(parseTable('x,y\n1,2\n\n3,4\n', 'a').rows, [['1', '2'], ['3', '4']]);
  assert.deepEqual(parseTable('"Pos x";"y"\r\n1;2\r\n', 'a').names, ['Pos x', 'y']);
  assert.deepEqual(parseTable('# x y\n1 2\n3 4', 'a').names, ['x', 'y']);
  assert.deepEqual(parseTable('1 2\n3 4', 'a'), { names: [], columnCount: 2, rows: [['1', '2'], ['3', '4']] });
});

test('a short row is refused with its line number', () => {
  assert.throws(() => parseTable('x,y\n1,2\n3\n', 'cut.csv'), /cut\.csv, line 3/);
  assert.throws(() => parseTable('', 'empty.csv'), InputError);
});

test('columns are found by common names', () => {
  const plan = planNamedColumns(['idp', 'Pos.x [m]', 'Pos.z [m]', 'Vel.x', 'Vel.z', 'Rhop']);
  assert.deepEqual(plan.positions, [1, null, 2]);
  assert.deepEqual(plan.velocities, [3, null, 4]);
  assert.equal(plan.id, 0);
  assert.deepEqual(plan.scalars, [{ name: 'Rhop', column: 5 }]);
  assert.ok(planNamedColumns(['id', 'xs', 'ys', 'zs']).scaled);
  assert.throws(() => planNamedColumns(['a', 'b']), /Name them x and y/);
});

const file = (name: string, text: string) => new File([text], name);

test('a CSV folder is one frame per file', async () => {
  const source = await openDropped([
    file('f10.csv', 'x,y,vx,vy,p\n1,2,3,4,5\n'), file('times.csv', 'frame,t\n0,0.5\n1,0.75\n'),
    file('f9.csv', 'x,y,vx,vy,p\n0,0,0,0,1\n1,0,0,0,2\n'),
  ]);
  assert.equal(source.count, 2);
  assert.deepEqual(source.scalars, ['p']);
  const first = await source.frame(0);
  assert.equal(first.time, 0.5);
  assert.equal(first.positionFormat, PositionFormat.FLOAT64_2);
  assert.deepEqual(doubles(first.positions), [0, 0, 1, 0]);
  const second = await source.frame(1);
  assert.deepEqual([...arrayOf(Float32Array, second.velocities ?? new Uint8Array())], [3, 4]);
});

test('frames without times have their number as time', async () => {
  const source = await openDropped([file('a.csv', 'x,y,vx,vy\n1,2,3,4\n')]);
  const frame = await source.frame(0);
  assert.deepEqual([frame.time, frame.velocities], [0, undefined]);
});

test('a plane is found among three axes; 3D is refused', async () => {
  const flat = await openDropped([file('a.csv', 'x,y,z\n0,7,1\n2,7,3\n')]);
  assert.deepEqual(doubles((await flat.frame(0)).positions), [0, 1, 2, 3]);
  await assert.rejects(openDropped([file('a.csv', 'x,y,z\n0,1,2\n3,4,0\n')]), /Extract a slice/);
});

test('duplicate ids are dropped, text in numbers is refused', async () => {
  const twice = await openDropped([file('a.csv', 'id,x,y\n1,0,0\n1,1,0\n')]);
  assert.equal((await twice.frame(0)).ids, undefined);
  await assert.rejects(openDropped([file('a.csv', 'x,y\n0,zero\n')]), /row 1: 'zero' is not a number/);
});

test('times are columns or a single column', () => {
  assert.deepEqual([...parseTimes('t\n1\n2\n', 'times.csv')], [[0, 1], [1, 2]]);
  assert.deepEqual([...parseTimes('frame,time\n3,1.5\n', 'times.csv')], [[3, 1.5]]);
  assert.throws(() => parseTimes('a,b\n1,2\n', 'times.csv'), InputError);
});

const DUMP = ['ITEM: TIMESTEP', '0', 'ITEM: NUMBER OF ATOMS', '2', 'ITEM: BOX BOUNDS pp pp pp',
  '0 10', '0 20', '-1 1', 'ITEM: ATOMS id type xs ys', '1 1 0.5 0.5', '2 1 0.1 0.2', ''].join('\n');

test('a LAMMPS dump is split and unscaled', async () => {
  const source = await LammpsSource.open(new Blob([DUMP + DUMP.replace('0.5 0.5', '0.25 0.5')]), 'd.lammpstrj');
  assert.equal(source.count, 2);
  assert.deepEqual(doubles((await source.frame(0)).positions), [5, 10, 1, 4]);
  assert.deepEqual(doubles((await source.frame(1)).positions), [2.5, 10, 1, 4]);
});

test('a truncated dump is refused with its frame', () => {
  assert.throws(() => parseLammpsFrame(DUMP.slice(0, -20), 4, 'd'), /d, frame 5 has|cells|no number/);
  assert.throws(() => parseLammpsFrame('ITEM: TIMESTEP\n1\n', 0, 'd'), /no atoms/);
});

test('a recording reads frames in any order', async () => {
  const source = RecordingSource.open(new Uint8Array(readFileSync(recording)), 'dam_break.pemc');
  assert.equal(source.count, 75);
  assert.equal(source.spacing, 0.0303);
  const last = await source.frame(74);
  const first = await source.frame(0);
  assert.equal(first.positions.length, 2278 * 8);
  assert.equal(first.positionFormat, PositionFormat.FLOAT32_2);
  assert.ok(last.time > first.time);
  assert.deepEqual((await source.frame(74)).positions, last.positions);
});

test('a truncated recording keeps its whole blocks', async () => {
  const bytes = new Uint8Array(readFileSync(recording));
  const cut = RecordingSource.open(bytes.slice(0, bytes.length / 2), 'cut.pemc');
  assert.ok(cut.count > 20 && cut.count < 60, `${cut.count}`);
  assert.ok((await cut.frame(cut.count - 1)).positions.length > 0);
  assert.throws(() => RecordingSource.open(bytes.slice(100), 'x'), /not a recording/);
});

test('unreadable files are refused with the readable kinds', async () => {
  await assert.rejects(openDropped([file('a.vtp', '<VTKFile>')]), /a\.vtp cannot be read here.*convert/);
  await assert.rejects(openDropped([]), InputError);
});

function cloud(count: number, ids?: bigint[]): Particles {
  const positions = Float32Array.from({ length: 2 * count }, (_, i) => i);
  return {
    time: 0, positionFormat: PositionFormat.FLOAT32_2, positions: bytesOf(positions),
    ids: ids && bytesOf(BigUint64Array.from(ids)),
    volumes: bytesOf(Float32Array.from({ length: count }, (_, i) => i)),
  };
}

test('a share selects rows of all arrays', () => {
  for (const percent of [80, 50, 30]) {
    const chosen = shareOf(cloud(10_000), percent);
    const count = chosen.positions.length / 8;
    assert.ok(Math.abs(count - 100 * percent) < 200, `${count} for ${percent} %`);
    const positions = arrayOf(Float32Array, chosen.positions);
    const volumes = arrayOf(Float32Array, chosen.volumes ?? new Uint8Array());
    volumes.forEach((volume, i) => assert.equal(positions[2 * i], 2 * volume));
  }
  const all = cloud(10);
  assert.equal(shareOf(all, 100), all);
});

test('a share does not depend on the order of particles', () => {
  const ids = Array.from({ length: 1000 }, (_, i) => BigInt(i) * 7919n);
  const chosen = (order: bigint[]) =>
    new Set(arrayOf(BigUint64Array, shareOf(cloud(1000, order), 50).ids ?? new Uint8Array()));
  assert.deepEqual([...chosen(ids)].sort(), [...chosen([...ids].reverse())].sort());
});
