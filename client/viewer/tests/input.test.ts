import { PositionFormat } from '@proto/v1/reconstruction_pb';
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import { planNamedColumns } from '../src/input/columns';
import { parseTimes } from '../src/input/csv';
import { inspectFiles } from '../src/input/drop';
import { parseLammpsFrame } from '../src/input/lammps';
import { naturalOrder, sortNaturally } from '../src/input/natural_order';
import { FieldError, type FileOptions, NO_OPTIONS, optionsText, parseOptions, parseSlices, parseSpacing } from '../src/input/options';
import { RecordingSource } from '../src/input/recording';
import { shareOf } from '../src/input/share';
import { InputError } from '../src/input/source';
import { nearPlane } from '../src/input/space';
import { parseTable } from '../src/input/table';
import { arrayOf, bytesOf } from '../src/protocol/arrays';
import type { Particles } from '../src/protocol/particles';
import { openDropped, recordingOf } from './open_dropped';

const doubles = (bytes: Uint8Array) => [...arrayOf(Float64Array, bytes)];
const recording = new URL('../../../recordings/dam_break.pemc', import.meta.url);

test('names are in natural order', () => {
  const names = ['f10.csv', 'f2.csv', 'f1.csv', 'a/f3.csv', 'f02.csv'];
  assert.deepEqual(names.sort(naturalOrder), ['a/f3.csv', 'f1.csv', 'f02.csv', 'f2.csv', 'f10.csv']);
});

test('decimal times in names are in their order', () => {
  for (const ordered of [
    ['p_0.05.csv', 'p_0.1.csv', 'p_0.15.csv', 'p_0.2.csv'],
    ['p_0.0.csv', 'p_0.005.csv', 'p_0.5.csv', 'p_1.0.csv', 'p_10.25.csv'],
    ['p_0.25.csv', 'p_0.5.csv', 'p_0.75.csv', 'p_1.0.csv'],
    ['p_0.10.csv', 'p_0.15.csv', 'p_0.20.csv'],
    ['run1.1.csv', 'run1.9.csv', 'run1.10.csv', 'run1.11.csv'],
    ['run1.08.csv', 'run1.99.csv', 'run1.100.csv'],
    ['v1.2.9.csv', 'v1.2.25.csv', 'v1.2.111.csv'],
    ['a.2.csv', 'a.15.csv'],
  ]) {
    assert.deepEqual(sortNaturally([...ordered].reverse(), (name) => name), ordered);
  }
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
  assert.throws(() => planNamedColumns(['a', 'b']), /Name the columns of x and y/);
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
  await assert.rejects(openDropped([file('a.csv', 'x,y,z\n0,1,2\n3,4,0\n')]), /Choose the plane/);
});

test('3D particles are read as surfaces, with planes as sections', async () => {
  assert.deepEqual(parseSlices('surface'), { isSurface: true, slices: [] });
  const both = parseSlices('z=1; surface');
  assert.deepEqual([both.isSurface, both.slices.map(({ origin }) => origin)], [true, [[0, 0, 1]]]);
  for (const wrong of ['surfaces', 'z= 1', 'z=0x10', 'z=1e70', 'z=', '0,0,0,0,0,1e-61', '0,0,0,0,0, 1', '0,0,0,0,0x1,1']) {
    assert.throws(() => parseSlices(wrong), /Write a plane as x=C/, wrong);
  }
  assert.deepEqual(parseSlices('0,0,-1e69,0,0,.5').slices, [{ origin: [0, 0, -1e69], normal: [0, 0, 0.5] }]);
  const ball = file('a.csv', 'x,y,z\n0,1,2\n3,4,0\n');
  const source = await openDropped([ball], { ...NO_OPTIONS, slice: 'surface', spacing: '1' });
  assert.ok(source.isSurface);
  assert.deepEqual(doubles((await source.frame(0)).positions), [0, 1, 2, 3, 4, 0]);
  const fieldOf = (field: string) => (error: unknown) => error instanceof FieldError && error.field === field;
  await assert.rejects(openDropped([ball], { ...NO_OPTIONS, slice: 'surface' }), fieldOf('spacing'));
  const flat = openDropped([file('a.csv', 'x,y\n0,1\n')], { ...NO_OPTIONS, slice: 'surface', spacing: '1' });
  await assert.rejects(flat, fieldOf('slice'));
});

test('columns with names that the server refuses are no scalars', async () => {
  const long = 'n'.repeat(65);
  const source = await openDropped([file('a.csv', `x,y,Größe,${long},p,p,q\n0,0,1,1,2,3,4\n1,0,1,1,2,3,4\n`)]);
  assert.deepEqual(source.scalars, ['p', 'q']);
  const { scalars } = await source.frame(0);
  assert.deepEqual(scalars?.map(({ name }) => name), ['p', 'q']);
  assert.deepEqual(new Float32Array(scalars?.[0].values.slice().buffer ?? new ArrayBuffer(0)), new Float32Array([2, 2]));
  const chosen = await openDropped([file('a.csv', 'x,y,Größe\n0,0,1\n1,0,2\n')], { ...NO_OPTIONS, select: 'Größe=2' });
  assert.equal((await chosen.frame(0)).positions.length, 16);
});

test('a spacing is a decimal number that the server accepts', () => {
  for (const wrong of ['0x10', ' 1', '0', '-1', '1e61', '1e-61', 'wide']) {
    assert.throws(() => parseSpacing(wrong), /must be a positive length/, wrong);
  }
  assert.deepEqual(['', ' ', '1e39', '.5'].map(parseSpacing), [null, null, 1e39, 0.5]);
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
  const source = await openDropped([file('d.lammpstrj', DUMP + DUMP.replace('0.5 0.5', '0.25 0.5'))]);
  assert.equal(source.count, 2);
  assert.deepEqual(doubles((await source.frame(0)).positions), [5, 10, 1, 4]);
  assert.deepEqual(doubles((await source.frame(1)).positions), [2.5, 10, 1, 4]);
});

/** A dump of one frame at step 250 with the atoms of `rows`. */
const dumpOf = (columns: string, rows: string[], box = ['0 10', '0 20', '-1 1'], bounds = 'pp pp pp') =>
  ['ITEM: TIMESTEP', '250', 'ITEM: NUMBER OF ATOMS', rows.length, `ITEM: BOX BOUNDS ${bounds}`, ...box,
    `ITEM: ATOMS ${columns}`, ...rows, ''].join('\n');

test('image flags unwrap a LAMMPS dump, and its step is the time', async () => {
  const tilted = ['0 14 4', '0 20 0', '-1 1 0'];
  const edges = ['10 0 0 0', '4 20 0 0', '0 0 2 -1'];
  for (const [text, positions] of [
    [dumpOf('id x y ix iy', ['1 1 2 0 0', '2 3 4 -1 2']), [1, 2, -7, 44]],
    [dumpOf('id xs ys ix iy', ['1 .5 .5 0 0', '2 .5 .5 1 -1']), [5, 10, 15, -10]],
    [dumpOf('id x y ix iy', ['1 1 2 0 1'], tilted, 'xy xz yz pp pp pp'), [5, 22]],
    [dumpOf('id x y ix iy', ['1 1 2 1 1'], edges, 'abc origin pp pp pp'), [15, 22]],
    [dumpOf('id xu yu ix iy', ['1 1 2 1 1']), [1, 2]],
  ] as const) {
    const frame = await (await openDropped([file('d.lammpstrj', text)])).frame(0);
    assert.deepEqual(doubles(frame.positions), positions);
    assert.equal(frame.time, 250);
  }
  const asked = await openDropped([file('d.lammpstrj', dumpOf('id x y ix iy', ['2 3 4 -1 2']))],
                                  { ...NO_OPTIONS, columns: 'x,y' });
  assert.deepEqual(doubles((await asked.frame(0)).positions), [3, 4]);
  await assert.rejects(openDropped([file('d.lammpstrj', dumpOf('id x y ix iy', ['2 3 4 .5 2']))]), /image flag 0.5/);
});

test('collections have the files in the order of their times', async () => {
  const members = [file('b.csv', 'x,y\n1,2\n'), file('a & ö.csv', 'x,y\n3,4\n')];
  const pvd = '<VTKFile type="Collection"><Collection>\n<!-- <DataSet timestep="9" file="gone.csv"/> -->\n' +
    '<DataSet timestep=\'2.5\' part=\'0\' file=\'run/a &amp; ö.csv\'/>\n<DataSet timestep="1" file="b.csv"/></Collection></VTKFile>';
  const series = '{"files": [{"name": "a & \\u00f6.csv", "time": 2.5}, {"time": 1, "name": "b.csv"}]}';
  for (const collection of [file('all.pvd', pvd), file('all.csv.series', series)]) {
    const source = await openDropped([...members, collection, file('other.csv', 'x,y\n9,9\n')]);
    assert.equal(source.title, collection.name);
    assert.equal(source.count, 2);
    const frames = [await source.frame(0), await source.frame(1)];
    assert.deepEqual(frames.map(({ time }) => time), [1, 2.5]);
    assert.deepEqual(frames.map(({ positions }) => doubles(positions)), [[1, 2], [3, 4]]);
  }
});

test('wrong collections are refused', async () => {
  const entry = (attributes: string) => `<DataSet ${attributes}/>`;
  const b = entry('timestep="1" file="b.csv"');
  for (const [name, text, message] of [
    ['a.pvd', '', /without files/],
    ['a.pvd', entry('file="b.csv"'), /'b\.csv' has not/],
    ['a.pvd', entry('timestep="nan" file="b.csv"'), /a file and a time/],
    ['a.pvd', entry('timestep="" file="b.csv"'), /a file and a time/],
    ['a.pvd', b + b, /several files at time 1/],
    ['a.pvd', entry('timestep="1" file="gone.vtp"'), /gone\.vtp, which is missing/],
    ['a.pvd', entry('timestep="1" file="d.lammpstrj"'), /which has 2 frames/],
    ['a.vtp.series', '{"files": [{"name"', /truncated or damaged/],
    ['a.vtp.series', '{"files": [{"name": "b.csv"}]}', /a file and a time/],
  ] as const) {
    await assert.rejects(openDropped([file(name, text), file('b.csv', 'x,y\n1,2\n'), file('d.lammpstrj', DUMP + DUMP)]),
                         message, text);
  }
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

test('a recording has the attributes that all frames have', async () => {
  const positions = bytesOf(Float32Array.of(0, 0, 1, 0));
  const p = { name: 'p', values: bytesOf(Float32Array.of(5, 6)) };
  const force = { name: 'force', values: bytesOf(Float32Array.of(1, 2, 3, 4)), components: 2 };
  const frameOf = (...scalars: { name: string; values: Uint8Array; components?: number }[]) =>
    ({ positionFormat: PositionFormat.FLOAT32_2, positions, scalars });
  const broken = { name: 'broken', values: bytesOf(Float32Array.of(NaN, 1)) };
  const early = { ...p, name: 'early' };
  const twice = { ...p, values: bytesOf(Float32Array.of(7, 8)) };
  const empty = { ...frameOf(), positions: new Uint8Array(0) };
  const whole = recordingOf(frameOf(p, { ...p, name: 'ρ' }, force, broken, early, twice),
    frameOf({ ...p, name: 'late' }, force, p, { ...early, values: broken.values }), empty);
  const source = await openDropped([whole]);
  assert.deepEqual([source.count, source.scalars], [3, ['p', 'force']]);
  const scalarsAt = async (index: number) => ((await source.frame(index)).scalars ?? [])
    .map(({ name, values, components }) => [name, components, ...arrayOf(Float32Array, values)]);
  assert.deepEqual(await scalarsAt(0), [['p', 1, 5, 6], ['force', 2, 1, 2, 3, 4]]);
  assert.deepEqual(await scalarsAt(1), [['force', 2, 1, 2, 3, 4], ['p', 1, 5, 6]]);
  for (const [scalar, message] of [
    [{ ...p, components: 4 }, /more than three components/], [{ ...p, components: 2 }, /8 bytes where 16 are due/],
  ] as const) {
    await assert.rejects(openDropped([recordingOf(frameOf(scalar))]),
      (error) => error instanceof InputError && message.test(error.message));
  }
});

test('a truncated recording keeps its whole blocks', async () => {
  const bytes = new Uint8Array(readFileSync(recording));
  const cut = RecordingSource.open(bytes.slice(0, bytes.length / 2), 'cut.pemc');
  assert.ok(cut.count > 20 && cut.count < 60, `${cut.count}`);
  assert.ok((await cut.frame(cut.count - 1)).positions.length > 0);
  assert.match(cut.notice, new RegExp(`cut\\.pemc is truncated\\. Its first ${cut.count} frames are whole`));
  assert.equal(RecordingSource.open(bytes, 'whole.pemc').notice, '');
  assert.throws(() => RecordingSource.open(bytes.slice(100), 'x'), /not a recording/);
});

test('unreadable files are refused by their kind, with a remedy', async () => {
  const refused = (name: string, text: string, message: RegExp) =>
    assert.rejects(openDropped([file(name, text)]), message);
  await assert.rejects(openDropped([new File([Uint8Array.of(0x89, 72, 68, 70, 13, 10, 26, 10)], 'a.h5')]), /an HDF5 file/);
  await refused('a.ply', 'ply\nformat ascii 1.0\n', /a PLY file/);
  await refused('a.pkl', 'x', /a Python pickle.*numpy\.savez/);
  await refused('in.txt2', '# run\nunits lj\natom_style atomic\n', /a LAMMPS input script.*Run it/);
  await refused('a.json', '{}', /a\.json is of an unknown kind\. The page reads CSV.*extended XYZ/);
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

const options = (given: Partial<FileOptions>) => ({ ...NO_OPTIONS, ...given });
const isAbout = (field: string, text: RegExp) => (error: unknown) =>
  error instanceof FieldError && error.field === field && text.test(error.message);

/** Particles of two types on a grid of `layers` layers, 0.1 apart. */
function block(layers: number): string {
  const rows = ['id,type,x,y,z,p'];
  for (let k = 0; k < layers; ++k) {
    for (let i = 0; i < 10; ++i) {
      for (let j = 0; j < 10; ++j) {
        rows.push([rows.length, 1 + (i & 1), i / 10, j / 10, k / 10, i * j].join());
      }
    }
  }
  return `${rows.join('\n')}\n`;
}

test('the defaults of options come from the file', async () => {
  const flat = await inspectFiles([file('flat.csv', block(1))]);
  assert.deepEqual(flat.facts, {
    spacing: '', columns: 'x,y,z', names: ['id', 'type', 'x', 'y', 'z', 'p'], filters: ['type=1', 'type=2'], slice: '',
    hasBox: false,
  });
  const { facts } = await inspectFiles([file('block.csv', block(5))]);
  assert.equal(facts.slice, 'z=0.2');
  assert.equal(facts.spacing, '0.1');
  const unknown = await inspectFiles([file('a.csv', 'a,b,c\n1,2,3\n')]);
  assert.deepEqual([unknown.facts.columns, unknown.facts.names], ['', ['a', 'b', 'c']]);
  await assert.rejects(unknown.open(NO_OPTIONS), isAbout('columns', /a\.csv: No position columns in a, b, c/));
  const whole = await inspectFiles([new File([readFileSync(recording)], 'dam_break.pemc')]);
  assert.deepEqual(whole.facts, { spacing: '0.0303', columns: '', names: [], filters: [], slice: '', hasBox: false });
});

test('options choose columns, particles, spacing and plane', async () => {
  const named = await openDropped([file('a.csv', 'a,b,c\n1,2,3\n')], options({ columns: 'c, 1' }));
  assert.deepEqual(doubles((await named.frame(0)).positions), [3, 1]);
  const depth = await openDropped([file('a.csv', 'x,y,z\n1,2,3\n')], options({ columns: 'x,z', spacing: '0.5' }));
  assert.deepEqual(doubles((await depth.frame(0)).positions), [1, 3]);
  assert.equal(depth.spacing, 0.5);
  const bare = await openDropped([file('a.txt', '7 1 2 9\n8 3 4 9\n')], options({ columns: 'id,x,y' }));
  assert.deepEqual(doubles((await bare.frame(0)).positions), [1, 2, 3, 4]);
  const half = await openDropped([file('a.csv', block(1))], options({ select: 'type=2' }));
  assert.equal((await half.frame(0)).positions.length, 50 * 16);
  const cut = await openDropped([file('a.csv', block(5))], options({ slice: 'z=0.2; y=0.4', spacing: '0.1' }));
  assert.deepEqual(cut.slices.map(({ origin, normal }) => [origin, normal]),
    [[[0, 0, 0.2], [0, 0, 1]], [[0, 0.4, 0], [0, -1, 0]]]);
  assert.equal((await cut.frame(0)).positionFormat, PositionFormat.FLOAT64_3);
});

test('a wrong option is refused by its field', async () => {
  const flat = await inspectFiles([file('a.csv', block(1))]);
  const solid = await inspectFiles([file('a.csv', block(5))]);
  const refused = (input: typeof flat, given: Partial<FileOptions>, field: string, text: RegExp) =>
    assert.rejects(input.open(options(given)), isAbout(field, text));
  await refused(flat, { spacing: '-1' }, 'spacing', /positive length/);
  await refused(flat, { columns: 'x' }, 'columns', /two or three columns, not 1/);
  await refused(flat, { columns: 'x,q' }, 'columns', /no column 'q'\. The columns are id, type/);
  await refused(flat, { select: 'type' }, 'select', /type=1/);
  await refused(flat, { select: 'kind=1' }, 'select', /no column 'kind'/);
  await refused(flat, { select: 'type=7' }, 'select', /No particle .* type=7/);
  await refused(solid, {}, 'slice', /is 3D \(extents 0\.900 x 0\.900 x 0\.400\)/);
  await refused(solid, { slice: 'z' }, 'slice', /x=C, y=C, z=C/);
  await refused(solid, { slice: 'z=0.2' }, 'spacing', /need their spacing/);
  const whole = await inspectFiles([new File([readFileSync(recording)], 'dam_break.pemc')]);
  await refused(whole, { columns: 'x,y' }, 'columns', /no columns/);
  await refused(whole, { slice: 'z=0' }, 'slice', /two coordinates/);
  assert.equal((await whole.open(options({ spacing: '0.05' }))).spacing, 0.05);
});

test('options are kept in a link', () => {
  const given = options({ spacing: '0.02', slice: 'z=0.5;y=1', periodic: 'x,y' });
  assert.deepEqual(parseOptions(optionsText(given)), given);
  assert.equal(optionsText(NO_OPTIONS), '');
});

test('particles beside a plane have its coordinates', async () => {
  const solid = await openDropped([file('a.csv', block(5))], options({ slice: 'y=0.4', spacing: '0.1' }));
  const near = nearPlane(await solid.frame(0), solid.slices[0], 0.05);
  assert.equal(near.positions.length / 16, 50);
  const [x, z] = doubles(near.positions.subarray(16 * 49));
  assert.deepEqual([x, z], [0.9, 0.4]);
  assert.equal(arrayOf(BigUint64Array, near.ids ?? new Uint8Array()).length, 50);
});

test('fractions of a box are positions in LAMMPS dumps only', async () => {
  const file = new File(['id,xs,ys\n1,.5,.5\n2,.25,.5\n'], 'fractions.csv');
  await assert.rejects(openDropped([file]), /fractions of the box of a LAMMPS dump/);
});
