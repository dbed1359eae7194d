// Damaged files: every error must be one for the user.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import { InputError } from '../src/input/source';
import { openDropped } from './open_dropped';

const SAMPLES = ['appended_raw_bigendian.vtu', 'appended_raw_zlib_u64.vtp', 'inline_base64_zlib.vtp', 'polydata_v51_binary.vtk',
  'ugrid_v42_binary.vtk', 'frame_deflate.npz', 'pos_f4_fortran.npy', 'dump.elem.xyz', 'dump.atom', 'dump.custom.unwrapped_scaled', 'ellipse.pemc'];
/** Damaged copies of each sample. */
const COPIES = 40;

/** A generator with a fixed seed (mulberry32). */
function random(seed: number): () => number {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

for (const name of SAMPLES) {
  test(`${name}, damaged, is read or refused`, async () => {
    const folder = name.endsWith('.pemc') ? 'recordings' : 'formats';
    const whole = readFileSync(new URL(`../../../../tests/data/${folder}/${name}`, import.meta.url));
    const next = random(name.length);
    for (let copy = 0; copy < COPIES; ++copy) {
      let bytes = new Uint8Array(whole);
      // Damage in the header and in the tail is more likely to pass the first checks.
      const place = () => Math.floor((copy % 3 === 0 ? next() : copy % 3 === 1 ? next() * 0.05 : 1 - next() * 0.05) * bytes.length);
      for (let k = 0; k < 1 + copy % 4; ++k) bytes[place()] = Math.floor(next() * 256);
      if (copy % 5 === 0) bytes = bytes.slice(0, place());
      try {
        const source = await openDropped([new File([bytes], name)]);
        for (let frame = 0; frame < Math.min(source.count, 3); ++frame) await source.frame(frame);
      } catch (error) {
        assert.ok(error instanceof InputError, `copy ${copy}: ${(error as Error).stack}`);
      }
    }
  });
}
