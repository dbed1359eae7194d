// Files of NumPy, VTK and XYZ, and kinds that the page refuses. Leaves a screenshot in build/screenshots.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import path from 'node:path';
import { before, test } from 'node:test';
import { cleansUp, launch, root, screenshots, until, Viewer, World } from './support.mjs';

let world, browser, viewer;
const place = (name) => path.join(world.folder, name);
const sample = (name) => path.join(root, 'tests/data/formats', name);

/** A drop of particles that moves, written by NumPy in each format, with float64 coordinates. */
const WRITE = `
import sys, numpy as np
folder = sys.argv[1]
i, j = np.meshgrid(np.arange(-9, 10), np.arange(-9, 10))
keep = i * i + j * j <= 81
base = np.stack([i[keep], j[keep]], axis=1) * .05
frames = np.stack([base + (k * .03, .4) for k in range(3)])
np.save(folder + '/frames.npy', frames)
table = np.zeros(len(base), [('id', '<i8'), ('x', '>f8'), ('y', '<f8'), ('p', '<f4')])
table['id'], table['x'], table['y'], table['p'] = np.arange(len(base)), *frames[1].T, base[:, 0]
np.save(folder + '/fields.npy', table)
np.savez_compressed(folder + '/arrays.npz', pos=frames[1], p=base[:, 0], t=.25)
with open(folder + '/drop.xyz', 'w') as out:
    for k, frame in enumerate(frames):
        print(len(frame), f'Properties=species:S:1:pos:R:2 Time={k * .25}', sep='\\n', file=out)
        for x, y in frame: print('A', repr(float(x)), repr(float(y)), file=out)
`;

before(async () => {
  world = await World.start();
  browser = await launch();
  execFileSync('/usr/bin/python3', ['-c', WRITE, world.folder]);
});
cleansUp(() => ({ world, browser, viewer }));

test('NPY, NPZ and XYZ have the digests of the command line', async () => {
  viewer = await Viewer.open(browser, world.url);
  const digests = new Map();
  for (const name of ['frames.npy', 'fields.npy', 'arrays.npz', 'drop.xyz']) {
    const hasValues = name === 'fields.npy' || name === 'arrays.npz';
    const truth = await world.statistics(place(name), ...hasValues ? ['--attributes', 'p'] : []);
    await viewer.drop(place(name));
    await until(name, async () => await viewer.pane().locator('.name').textContent() === name);
    await viewer.allFrames();
    const last = truth[truth.length - 1];
    await viewer.scrubTo(truth.length, truth.length - 1);
    await until(`${name} as the command line`, async () => await viewer.value('rings-digest') === last.rings_digest);
    assert.equal(await viewer.value('mesh-digest'), last.mesh_digest);
    assert.equal(Number(await viewer.value('time')), last.time);
    digests.set(name, last.rings_digest);
  }
  assert.equal(digests.get('frames.npy'), digests.get('drop.xyz'));
  assert.equal(digests.get('fields.npy'), digests.get('arrays.npz'));
});

test('files of other programs have the digests of the command line', async () => {
  viewer = await Viewer.open(browser, world.url);
  for (const name of ['frame_deflate.npz', 'dump.elem.xyz', 'dump.atom', 'appended_raw_bigendian.vtu',
    'appended_raw_zlib_u64.vtp', 'inline_base64_zlib.vtp', 'polydata_v51_binary.vtk', 'ugrid_v42_binary.vtk']) {
    const [truth] = await world.statistics(sample(name), '--frames', '0:1');
    await viewer.drop(sample(name));
    await until(name, async () => await viewer.pane().locator('.name').textContent() === name);
    await until('its first frame', async () => await viewer.value('rings-digest') !== '');
    await viewer.scrubTo(1, 0);
    await until(`${name} as the command line`, async () => await viewer.value('rings-digest') === truth.rings_digest);
  }
});

test('a collection dropped with its files has the times and digests of the command line', async () => {
  viewer = await Viewer.open(browser, world.url);
  const names = [2, 0, 1].map((k) => {
    const rows = Array.from({ length: 400 }, (_, i) => `${(i % 20) * (1 + 0.02 * k)},${Math.floor(i / 20)},0.1,${-k}`);
    writeFileSync(place(`part_${k}.csv`), ['x,y,vx,vy', ...rows, ''].join('\n'));
    return [`part_${k}.csv`, [0.5, 0.75, 1.25][k]];
  });
  const lists = {
    'all.pvd': `<VTKFile type="Collection"><Collection>${names.map(([name, time]) =>
      `<DataSet timestep="${time}" file="${name}"/>`).join('')}</Collection></VTKFile>`,
    'all.csv.series': JSON.stringify({ files: names.map(([name, time]) => ({ name, time })) }),
  };
  for (const [name, text] of Object.entries(lists)) {
    writeFileSync(place(name), text);
    const truth = await world.statistics(place(name));
    await viewer.drop(place(name), ...names.map(([file]) => place(file)));
    await until(name, async () => await viewer.pane().locator('.name').textContent() === name);
    await viewer.allFrames();
    for (const k of [0, 2]) {
      await viewer.scrubTo(k + 1, k);
      await until(`frame ${k} as the command line`, async () => await viewer.value('rings-digest') === truth[k].rings_digest);
      assert.equal(Number(await viewer.value('time')), truth[k].time);
    }
  }
});

test('other kinds are refused by name, with what to do', async () => {
  viewer = await Viewer.open(browser, world.url);
  writeFileSync(place('run.h5'), Buffer.from('\x89HDF\r\n\x1a\n', 'latin1'));
  for (const [file, kind] of [
    [sample('binary_le.ply'), 'a PLY file'], [place('run.h5'), 'an HDF5 file'], [sample('in.styles'), 'a LAMMPS input script'],
  ]) {
    await viewer.drop(file);
    const name = path.basename(file);
    await until(kind, async () => (await viewer.status()).startsWith(`${name} is ${kind}, which the page cannot read. Run `));
  }
  await viewer.drop(sample('appended_raw_lz4.vtp'));
  await until('the compression', async () => /compressed by vtkLZ4DataCompressor, which the page cannot read\. Run /.test(await viewer.status()));
  await viewer.page.screenshot({ path: path.join(screenshots, 'file_refused.png') });
});
