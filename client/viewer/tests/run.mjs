// Runs the unit tests: bundles every tests/*.test.ts for node's test runner.
//   node tests/run.mjs [NAME...]
// Fails if the committed report differs from its sources.
import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { buildReport, buildReportSpace, unpackedText } from '../build.mjs';

const here = path.dirname(fileURLToPath(import.meta.url));
const viewer = path.dirname(here);
const out = path.join(viewer, 'build/tests');
const names = process.argv.slice(2);

if (!existsSync(path.join(viewer, 'build/generated'))) {
  throw new Error('build the page first: client/viewer/build.sh generates the messages');
}
const committed = (name) => readFileSync(path.join(viewer, '../output', name), 'utf8');
if (await buildReport() !== committed('report_page.html') ||
    await buildReportSpace() !== unpackedText(committed('report_space.txt'))) {
  throw new Error('client/output/report_page.html or report_space.txt is out of date: run client/viewer/build.sh --report');
}
rmSync(out, { recursive: true, force: true });
const tests = readdirSync(here).filter((name) => name.endsWith('.test.ts'))
  .filter((name) => names.length === 0 || names.some((part) => name.includes(part)));
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
