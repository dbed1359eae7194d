// Builds the page: messages from the .proto files, type check, one script and one style sheet, and
// the packed copies that the server sends. Fails where the page is above its limit.
//
//   node build.mjs [--out DIR] [--debug]
//
// What comes out lies in DIR (default: build/page): index.html, page.js, page.css, icon.svg, and
// the .gz of each.
import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';
import { build } from 'esbuild';

/** Bytes of the whole page as it is sent, packed. */
const LIMIT = 150_000;

const here = path.dirname(fileURLToPath(import.meta.url));
const root = path.resolve(here, '../..');
const debug = process.argv.includes('--debug');
const given = process.argv.indexOf('--out');
const out = path.resolve(given > 0 ? process.argv[given + 1] : path.join(here, 'build/page'));

/** TypeScript of the messages, by protoc and protoc-gen-es. */
export function generate() {
  const generated = path.join(here, 'build/generated');
  mkdirSync(generated, { recursive: true });
  const plugin = path.join(here, 'node_modules/.bin/protoc-gen-es');
  const files = ['partiemc/v1/reconstruction.proto', 'partiemc/recording/v1/recording.proto'];
  execFileSync('protoc', [
    `--plugin=protoc-gen-es=${plugin}`,
    `--proto_path=${path.join(root, 'proto')}`,
    `--es_out=${generated}`,
    '--es_opt=target=ts',
    ...files,
  ], { stdio: 'inherit' });
}

function check() {
  const tsc = path.join(here, 'node_modules/.bin/tsc');
  execFileSync(tsc, ['--noEmit', '--project', here], { stdio: 'inherit', cwd: here });
}

async function bundle() {
  rmSync(out, { recursive: true, force: true });
  mkdirSync(out, { recursive: true });
  await build({
    entryPoints: { page: path.join(here, 'src/ui/main.ts') },
    outdir: out,
    bundle: true,
    format: 'esm',
    target: 'es2022',
    minify: !debug,
    sourcemap: debug ? 'inline' : false,
    legalComments: 'none',
    tsconfig: path.join(here, 'tsconfig.json'),
    absWorkingDir: here,
    logLevel: 'warning',
  });
  for (const name of ['index.html', 'icon.svg']) {
    cpSync(path.join(here, 'src/ui', name), path.join(out, name));
  }
}

function pack() {
  let total = 0;
  for (const name of readdirSync(out).sort()) {
    const bytes = readFileSync(path.join(out, name));
    const packed = gzipSync(bytes, { level: 9 });
    writeFileSync(path.join(out, `${name}.gz`), packed);
    total += packed.length;
    console.log(`${name}: ${bytes.length} bytes, packed ${packed.length}`);
  }
  console.log(`the page: ${total} bytes packed, at most ${LIMIT}`);
  if (!debug && total > LIMIT) throw new Error(`the page has ${total} bytes, at most ${LIMIT}`);
}

generate();
check();
await bundle();
pack();
