// Runs the unit tests: every tests/*.test.ts, bundled, by node's own runner.
//   node tests/run.mjs [NAME...]
import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync, rmSync } from 'node:fs';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const here = path.dirname(fileURLToPath(import.meta.url));
const viewer = path.dirname(here);
const out = path.join(viewer, 'build/tests');
const wanted = process.argv.slice(2);

if (!existsSync(path.join(viewer, 'build/generated'))) {
  throw new Error('build the page first: client/viewer/build.sh makes the messages');
}
rmSync(out, { recursive: true, force: true });
const tests = readdirSync(here).filter((name) => name.endsWith('.test.ts'))
  .filter((name) => wanted.length === 0 || wanted.some((part) => name.includes(part)));
await build({
  entryPoints: tests.map((name) => path.join(here, name)),
  outdir: out,
  outExtension: { '.js': '.mjs' },
  bundle: true,
  platform: 'node',
  format: 'esm',
  sourcemap: 'inline',
  tsconfig: path.join(viewer, 'tsconfig.json'),
  logLevel: 'warning',
});
const files = tests.map((name) => path.join(out, name.replace(/\.ts$/, '.mjs')));
const { status } = spawnSync(process.execPath, ['--enable-source-maps', '--test', '--test-reporter=spec', ...files],
                             { stdio: 'inherit' });
process.exit(status ?? 1);
