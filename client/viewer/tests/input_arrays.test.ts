// Arrays of NumPy, and XYZ.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import { deflateRawSync, gzipSync } from 'node:zlib';
import { inspectFiles } from '../src/input/drop';
import { parseNpyHeader, parsePython } from '../src/input/npy';
import { NO_OPTIONS } from '../src/input/options';
import { InputError } from '../src/input/source';
import { arrayOf, bytesOf } from '../src/protocol/arrays';
import { openDropped } from './open_dropped';

const doubles = (bytes: Uint8Array) => [...arrayOf(Float64Array, bytes)];
const data = (name: string) => new File([readFileSync(new URL(`../../../../tests/data/formats/${name}`, import.meta.url))], name);
const file = (name: string, ...parts: (string | Uint8Array)[]) => new File(parts as BlobPart[], name);

/** An NPY array as numpy.save writes it. */
function npy(descr: string, shape: string, elements: ArrayBufferView, order = 'False'): Uint8Array {
  const head = `{'descr': ${descr}, 'fortran_order': ${order}, 'shape': ${shape}, }`;
  const text = head.padEnd(117, ' ') + '\n';
  const length = text.length;
  const start = Uint8Array.of(0x93, 78, 85, 77, 80, 89, 1, 0, length & 255, length >> 8);
  return new Uint8Array([...start, ...new TextEncoder().encode(text), ...bytesOf(elements)]);
}

/** A zip archive as numpy.savez writes it. */
function zip(entries: Record<string, Uint8Array>, deflated: boolean): Uint8Array {
  const parts: Uint8Array[] = [];
  const list: Uint8Array[] = [];
  let at = 0;
  for (const [name, bytes] of Object.entries(entries)) {
    const packed = deflated ? new Uint8Array(deflateRawSync(bytes)) : bytes;
    const title = new TextEncoder().encode(`${name}.npy`);
    const fields = (extra: number) => {
      const view = new DataView(new ArrayBuffer(26));
      view.setUint16(4, deflated ? 8 : 0, true);
      view.setUint32(14, packed.length, true);
      view.setUint32(18, bytes.length, true);
      view.setUint16(22, title.length, true);
      view.setUint16(24, extra, true);
      return new Uint8Array(view.buffer);
    };
    const local = [Uint8Array.of(0x50, 0x4b, 3, 4), fields(4), title, Uint8Array.of(1, 0, 0, 0), packed];
    const tail = new DataView(new ArrayBuffer(14));
    tail.setUint32(10, at, true);
    list.push(Uint8Array.of(0x50, 0x4b, 1, 2, 20, 0), fields(0), new Uint8Array(tail.buffer), title);
    parts.push(...local);
    at += local.reduce((sum, { length }) => sum + length, 0);
  }
  const size = list.reduce((sum, { length }) => sum + length, 0);
  const end = new DataView(new ArrayBuffer(22));
  end.setUint32(0, 0x06054b50, true);
  end.setUint16(10, Object.keys(entries).length, true);
  end.setUint32(12, size, true);
  end.setUint32(16, at, true);
  return new Uint8Array(Buffer.concat([...parts, ...list, new Uint8Array(end.buffer)]));
}

test('an NPY array has a row per particle', async () => {
  const rows = await openDropped([file('a.npy', npy("'<f4'", '(2, 2)', Float32Array.of(1, 2, 3, 4)))]);
  assert.deepEqual(doubles((await rows.frame(0)).positions), [1, 2, 3, 4]);
  const fortran = await openDropped([file('a.npy', npy("'<f8'", '(3, 2)', Float64Array.of(1, 2, 3, 4, 5, 6), 'True'))]);
  assert.deepEqual(doubles((await fortran.frame(0)).positions), [1, 4, 2, 5, 3, 6]);
  const big = new DataView(new ArrayBuffer(16));
  big.setFloat64(0, 7.5);
  big.setFloat64(8, -1);
  const swapped = await openDropped([file('a.npy', npy("'>f8'", '(1, 2)', new Uint8Array(big.buffer)))]);
  assert.deepEqual(doubles((await swapped.frame(0)).positions), [7.5, -1]);
  const { facts } = await inspectFiles([data('pos_f4_fortran.npy')]);
  assert.equal(facts.columns.slice(0, 3), 'x,y');
});

test('an NPY array of frames is a sequence', async () => {
  const frames = await openDropped([file('a.npy.gz', gzipSync(npy("'<f8'", '(2, 2, 2)', Float64Array.from([0, 1, 2, 3, 4, 5, 6, 7]))))]);
  assert.equal(frames.count, 2);
  const last = await frames.frame(1);
  assert.deepEqual([last.time, ...doubles(last.positions)], [1, 4, 5, 6, 7]);
});

test('a structured NPY array has named columns', async () => {
  const bytes = new DataView(new ArrayBuffer(2 * 28));
  for (const row of [0, 1]) {
    bytes.setBigUint64(28 * row, BigInt(10 + row), true);
    bytes.setFloat64(28 * row + 8, row + 0.5, true);
    bytes.setFloat64(28 * row + 16, row + 2.5, true);
    bytes.setFloat32(28 * row + 24, row * 3, true);
  }
  const array = npy("[('id', '<u8'), ('pos', '<f8', (2,)), ('p', '<f4')]", '(2,)', new Uint8Array(bytes.buffer));
  const source = await openDropped([file('a.npy', array)]);
  const frame = await source.frame(0);
  assert.deepEqual(doubles(frame.positions), [0.5, 2.5, 1.5, 3.5]);
  assert.deepEqual([...arrayOf(BigUint64Array, frame.ids ?? new Uint8Array())], [10n, 11n]);
  assert.deepEqual(source.scalars, ['p']);
});

test('an NPZ file has an array per column', async () => {
  for (const deflated of [false, true]) {
    const archive = zip({
      x: npy("'<f8'", '(3,)', Float64Array.of(1, 2, 3)), y: npy("'<f8'", '(3,)', Float64Array.of(4, 5, 6)),
      vel: npy("'<f4'", '(3, 2)', Float32Array.of(1, 2, 3, 4, 5, 6)), t: npy("'<f8'", '()', Float64Array.of(0.75)),
      material: npy("'<i4'", '(3,)', Int32Array.of(1, 1, 2)), box: npy("'<f8'", '(2,)', Float64Array.of(9, 9)),
    }, deflated);
    const input = await inspectFiles([file('a.npz', archive)]);
    const source = await input.open({ ...NO_OPTIONS, select: 'material=1' });
    const frame = await source.frame(0);
    assert.deepEqual([frame.time, ...doubles(frame.positions)], [0.75, 1, 4, 2, 5]);
    assert.deepEqual([...arrayOf(Float32Array, frame.velocities ?? new Uint8Array())], [1, 2, 3, 4]);
    assert.deepEqual(source.scalars, ['material']);
    await assert.rejects(input.open({ ...NO_OPTIONS, select: 'material=fluid' }), /has numbers/);
  }
  const real = await openDropped([data('frame_deflate.npz')]);
  assert.ok((await real.frame(0)).positions.length > 0);
});

test('damaged and unknown arrays are refused', async () => {
  const refused = (name: string, bytes: Uint8Array, message: RegExp) =>
    assert.rejects(openDropped([file(name, bytes)]), (error) => error instanceof InputError && message.test(error.message));
  const whole = npy("'<f8'", '(2, 2)', Float64Array.of(1, 2, 3, 4));
  await refused('a.npy', whole.slice(0, -5), /truncated/);
  await refused('a.npy', npy("'|O'", '(2,)', new Uint8Array(0)), /pickled Python objects/);
  await refused('a.npy', npy("'<c16'", '(2, 2)', new Uint8Array(0)), /type '<c16'/);
  await refused('a.npy', npy("'<f8'", '(2, 2, 2, 2)', Float64Array.from({ length: 16 }, () => 0)), /shape \(2, 2, 2, 2\)/);
  await refused('a.npy', npy("'<f8'", '(0, 1000000000)', new Uint8Array(0)), /shape \(0, 1000000000\)/);
  await refused('a.npy', npy("'<f8'", '(3, 0, 1000000000)', new Uint8Array(0)), /shape \(3, 0, 1000000000\)/);
  await refused('a.npy', npy("'<f8'", '(1, 2, 2)', Float64Array.of(1, 2, 3, 4), 'True'), /ascontiguousarray/);
  const archive = zip({ x: whole, y: whole }, true);
  await refused('a.npz', archive.slice(0, -30), /truncated or damaged/);
  const long = archive.slice();
  long[long.length - 22 - 5 - 46 + 28] = 255;  // The length of the last name.
  await refused('a.npz', long, /truncated or damaged/);
  const damaged = archive.slice();
  damaged.fill(0x55, 45, 90);
  await refused('a.npz', damaged, /a\.npz: x\.npy is damaged/);
  const array = npy("'<f8'", '(1,)', Float64Array.of(1));
  await refused('a.npz', zip({ particles: array, solver_data: array, version: array }, false), /NPZ file of PySPH.*convert/);
});

test('Python literals are parsed', () => {
  assert.deepEqual(parsePython("{'a': [('x', '<f8'), (\"y'\", '<f4', (2, 3))], 'b': (5,), 'c': False, }"),
    { a: [['x', '<f8'], ["y'", '<f4', [2, 3]]], b: [5], c: false });
  for (const bad of ['{', "{'a' 1}", '(1', 'f(2)', '']) assert.throws(() => parsePython(bad), bad);
  assert.throws(() => parseNpyHeader(new Uint8Array(20), 'a'), InputError);
});

const XYZ = ['2', 'Lattice="9 0 0 0 9 0 0 0 9" Properties=species:S:1:pos:R:3:velo:R:3:p:R:1 Time=0.5',
  'Ar 1 2 0 5 6 0 7', 'H 3 4 0 7 8 0 9'].join('\n');

test('extended XYZ names its columns and its time', async () => {
  const input = await inspectFiles([file('a.extxyz', `${XYZ}\n${XYZ.replace('Time=0.5', 'Time=0.75')}\n\n`)]);
  const source = await input.open(NO_OPTIONS);
  assert.equal(source.count, 2);
  const frame = await source.frame(1);
  assert.deepEqual([frame.time, ...doubles(frame.positions)], [0.75, 1, 2, 3, 4]);
  assert.deepEqual([...arrayOf(Float32Array, frame.velocities ?? new Uint8Array())], [5, 6, 7, 8]);
  assert.ok(source.scalars.includes('p') && !source.scalars.includes('species'), source.scalars.join());
  const argon = await input.open({ ...NO_OPTIONS, select: 'species=Ar' });
  assert.deepEqual(doubles((await argon.frame(0)).positions), [1, 2]);
});

test('plain XYZ has type, x, y, z; a cut file is refused', async () => {
  const source = await openDropped([file('a.xyz.gz', gzipSync('2\n\nA 1 2 0\nA 3 4 0\n'))]);
  assert.deepEqual(doubles((await source.frame(0)).positions), [1, 2, 3, 4]);
  await assert.rejects(openDropped([file('a.xyz', XYZ.slice(0, -20))]), /ends after 1 of 2|of 8 columns/);
  await assert.rejects(openDropped([file('a.xyz', '3\n\nA 1 2 0\n')]), /frame 0 ends after 1 of 3 particles/);
  await assert.rejects(openDropped([file('a.xyz', '1\n\n1 2 0\n')]), /3 of 4 columns: type, x, y, z\./);
  await assert.rejects(openDropped([data('splashsurf_raw_f4.xyz')]), /raw binary XYZ.*numpy\.fromfile/);
});
