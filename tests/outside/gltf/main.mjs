// Reads GLB files with glTF-Transform and meshoptimizer's decoder, and validates them with Khronos'
// glTF-Validator.
//   node main.mjs FOLDER_OF_PLAIN_FILES FOLDER_OF_THE_SAME_FILES_COMPRESSED
import assert from 'node:assert';
import { readdirSync, readFileSync } from 'node:fs';
import path from 'node:path';
import { NodeIO } from '@gltf-transform/core';
import { EXTMeshoptCompression } from '@gltf-transform/extensions';
import { validateBytes } from 'gltf-validator';
import { MeshoptDecoder } from 'meshoptimizer';

await MeshoptDecoder.ready;
const io = new NodeIO().registerExtensions([EXTMeshoptCompression])
  .registerDependencies({ 'meshopt.decoder': MeshoptDecoder });

/** Each triangle, rotated to begin with its smallest index. */
function rotated(indices) {
  const triangles = [];
  for (let k = 0; k < indices.length; k += 3) {
    const one = [...indices.slice(k, k + 3)];
    const first = one.indexOf(Math.min(...one));
    triangles.push(...one.slice(first), ...one.slice(0, first));
  }
  return triangles;
}

async function primitivesOf(file) {
  const bytes = new Uint8Array(readFileSync(file));
  const { issues } = await validateBytes(bytes);
  const serious = issues.messages.filter(({ severity }) => severity <= 1);
  assert.deepEqual(serious, [], file);
  const document = await io.readBinary(bytes);
  return document.getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives()).map((primitive) => ({
    mode: primitive.getMode(),
    indices: primitive.getIndices().getArray(),
    attributes: primitive.listSemantics().map((name) => [name, primitive.getAttribute(name).getArray()]),
  }));
}

const [plain, packed] = process.argv.slice(2);
const names = readdirSync(plain);
assert.deepEqual(readdirSync(packed), names);
const sizes = [0, 0];
for (const name of names) {
  const files = [plain, packed].map((folder) => path.join(folder, name));
  const [expected, found] = await Promise.all(files.map(primitivesOf));
  assert.deepEqual(found.map(({ attributes }) => attributes), expected.map(({ attributes }) => attributes), name);
  assert.equal(found.length, expected.length);
  for (const [k, { mode, indices }] of expected.entries()) {
    assert.equal(found[k].mode, mode);
    const inOrder = mode === 4 ? rotated : Array.from;
    assert.deepEqual(inOrder(found[k].indices), inOrder(indices), name);
  }
  files.forEach((file, k) => { sizes[k] += readFileSync(file).length; });
}
console.log(`${names.length} files, ${sizes[0]} bytes, compressed ${sizes[1]}: the same arrays`);
