// Runs the tests of the page in Chromium, one file at a time.
//   node tests/page/run.mjs [NAME...]
// PARTIEMC_BIN: folder of partiemc and partiemc-server (default: build/release/bin).
import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync } from 'node:fs';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

const here = path.dirname(fileURLToPath(import.meta.url));
if (!existsSync(path.join(here, '../../build/page/index.html'))) {
  throw new Error('build the page first: client/viewer/build.sh');
}
const names = process.argv.slice(2);
const files = readdirSync(here).filter((name) => name.endsWith('.test.mjs'))
  .filter((name) => names.length === 0 || names.some((part) => name.includes(part)))
  .map((name) => path.join(here, name));
const { status } = spawnSync(process.execPath, ['--test', '--test-reporter=spec', '--test-concurrency=1', ...files],
                             { stdio: 'inherit' });
process.exit(status ?? 1);
