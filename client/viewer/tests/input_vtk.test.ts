// VTK files, as VTK writes them and by hand.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import { deflateSync } from 'node:zlib';
import { InputError } from '../src/input/source';
import { arrayOf, bytesOf } from '../src/protocol/arrays';
import { openDropped } from './open_dropped';

const doubles = (bytes: Uint8Array) => [...arrayOf(Float64Array, bytes)];
const data = (name: string) => new File([readFileSync(new URL(`../../../../tests/data/formats/${name}`, import.meta.url))], name);
const file = (name: string, text: string) => new File([text], name);

const POINTS = [1, 2, 0, 3, 4, 0];
const ARRAYS = { p: [5, 6], vel: [7, 8, 0, 9, 10, 0] };

function xml(array: (name: string, components: number, values: number[]) => string, more = '', appended = ''): string {
  return `<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt32"${more}>
<PolyData><FieldData>${array('TimeValue', 1, [0.25])}</FieldData><Piece NumberOfPoints="2" NumberOfVerts="0">
<PointData Scalars="p">${array('p', 1, ARRAYS.p)}${array('vel', 3, ARRAYS.vel)}</PointData>
<Points>${array('Points', 3, POINTS)}</Points><Verts>${array('offsets', 1, [1, 2])}</Verts></Piece></PolyData>${appended}</VTKFile>`;
}

const open = (name: string, components: number, format: string) =>
  `<DataArray type="Float64" Name="${name}" NumberOfComponents="${components}" format="${format}"`;
const base64 = (...parts: ArrayBufferView[]) => Buffer.concat(parts.map(bytesOf)).toString('base64');

async function isTheFrame(given: File): Promise<void> {
  const source = await openDropped([given]);
  const frame = await source.frame(0);
  assert.deepEqual([frame.time, ...doubles(frame.positions)], [0.25, 1, 2, 3, 4], given.name);
  assert.deepEqual([...arrayOf(Float32Array, frame.velocities ?? new Uint8Array())], [7, 8, 9, 10]);
  assert.deepEqual(source.scalars, ['p']);
}

test('VTK XML is read as text, base64, compressed and appended', async () => {
  await isTheFrame(file('text.vtp', xml((name, components, values) =>
    `${open(name, components, 'ascii')}>\n ${values.join(' ')}\n</DataArray>`)));
  await isTheFrame(file('base64.vtp', xml((name, components, values) =>
    `${open(name, components, 'binary')}>${base64(Uint32Array.of(8 * values.length), Float64Array.from(values))}</DataArray>`)));
  await isTheFrame(file('packed.vtp', xml((name, components, values) => {
    const packed = deflateSync(bytesOf(Float64Array.from(values)));
    const head = Uint32Array.of(1, 32768, 8 * values.length, packed.length);
    return `${open(name, components, 'binary')}>${base64(head)}${base64(packed)}</DataArray>`;
  }, ' compressor="vtkZLibDataCompressor"')));
  let letters = '';
  const text = xml((name, components, values) => {
    const offset = letters.length;
    letters += base64(Uint32Array.of(8 * values.length), Float64Array.from(values));
    return `${open(name, components, 'appended')} offset="${offset}"/>`;
  });
  await isTheFrame(file('appended.vtp', text.replace('</VTKFile>', `<AppendedData encoding="base64">_${letters}</AppendedData></VTKFile>`)));
});

const LEGACY = ['# vtk DataFile Version 3.0', 'title', 'ASCII', 'DATASET POLYDATA', 'FIELD FieldData 1', 'TIME 1 1 double', '0.25',
  'POINTS 2 float', POINTS.join(' '), 'VERTICES 2 4', '1 0', '1 1', 'CELL_DATA 2', 'SCALARS c int', 'LOOKUP_TABLE default', '8 9',
  'POINT_DATA 2', 'SCALARS p double 1', 'LOOKUP_TABLE default', '5', '6', 'METADATA', 'INFORMATION 0', '',
  'VECTORS vel float', ARRAYS.vel.join('\n'), ''].join('\n');

test('legacy VTK is read as text', async () => {
  await isTheFrame(file('a.vtk', LEGACY));
  await isTheFrame(file('b.vtk', LEGACY.replace('VERTICES 2 4\n1 0\n1 1', 'VERTICES 3 2\nOFFSETS vtktypeint64\n0 1 2\nCONNECTIVITY vtktypeint64\n0 1')));
});

test('a legacy VTK name that is not UTF-8 stays encoded', async () => {
  for (const [written, name] of [['p%20q', 'p q'], ['100%', '100%'], ['a%FFb', 'a%FFb']]) {
    const source = await openDropped([file('a.vtk', LEGACY.replace('SCALARS p', `SCALARS ${written}`))]);
    assert.deepEqual(source.scalars, [name]);
  }
});

test('files of VTK have the same particles in every encoding', async () => {
  const names = ['appended_raw_bigendian.vtu', 'appended_raw_zlib_u64.vtp', 'inline_base64_zlib.vtp', 'polydata_v51_binary.vtk',
    'ugrid_v42_binary.vtk'];
  let ids = '';
  for (const name of names) {
    const source = await openDropped([data(name)]);
    const frame = await source.frame(0);
    assert.equal(frame.positions.length / 16, 587, name);
    assert.equal(frame.time, 1);
    assert.equal(frame.velocities?.length, 8 * 587);
    assert.ok(source.scalars.includes('Density'), source.scalars.join());
    const these = arrayOf(BigUint64Array, frame.ids ?? new Uint8Array()).join();
    ids ||= these;
    assert.equal(these, ids, name);
  }
});

test('damaged VTK files, and those of other kinds, are refused', async () => {
  const refused = (given: File, message: RegExp) =>
    assert.rejects(openDropped([given]), (error) => error instanceof InputError && message.test(error.message));
  await refused(data('appended_raw_lz4.vtp'), /compressed by vtkLZ4DataCompressor.*convert/);
  await refused(file('a.vti', '<VTKFile type="ImageData">'), /of the type ImageData/);
  await refused(file('a.vtk', LEGACY.replace('POLYDATA', 'STRUCTURED_POINTS')), /STRUCTURED_POINTS/);
  await refused(file('a.vtk', LEGACY.slice(0, LEGACY.indexOf('3 4 0'))), /truncated/);
  await refused(file('a.vtk', LEGACY.replace('VERTICES', 'NONSENSE')), /the section NONSENSE/);
  const two = xml(() => '').replace('</Piece>', '</Piece><Piece NumberOfPoints="1"></Piece>');
  await refused(file('a.vtp', two), /several pieces/);
  for (const name of ['appended_raw_bigendian.vtu', 'polydata_v51_binary.vtk', 'ugrid_v42_binary.vtk']) {
    const whole = readFileSync(new URL(`../../../../tests/data/formats/${name}`, import.meta.url));
    await refused(new File([whole.subarray(0, 4000)], name), /truncated or damaged|damaged: it is truncated|no points/);
  }
});
