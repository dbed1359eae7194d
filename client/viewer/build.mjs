// Builds the page and the report: messages from the .proto files, type check, scripts, style sheets.
// Fails if the page exceeds its size limit.
//
//   node build.mjs [--out DIR] [--debug]    the page, in DIR (default: build/page)
//   node build.mjs --report                 the report, in client/output/report_page.html and report_space.txt
//
// The page has index.html, page.js, page.css, icon.svg, each with a compressed copy (.gz). It loads
// space.js (drawing) and space_worker.js (decoder) when it shows a surface. The report is one file,
// which C++ completes, for surfaces with the part that draws them. Both are committed, so that `partiemc`
// builds without npm.
import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { gunzipSync, gzipSync } from 'node:zlib';
import { build } from 'esbuild';

/** Limits in bytes, compressed: of the page, and of the part that it loads to show surfaces. */
const LIMIT = 150_000;
const SPACE_LIMIT = 250_000;
/** Limits in characters, of the committed report and its part for surfaces. */
const REPORT_LIMIT = 200_000;
const REPORT_SPACE_LIMIT = 300_000;
const SPACE_FILES = ['space.js', 'space_worker.js'];

const here = path.dirname(fileURLToPath(import.meta.url));
const root = path.resolve(here, '../..');
const debug = process.argv.includes('--debug');
const given = process.argv.indexOf('--out');
const out = path.resolve(given > 0 ? process.argv[given + 1] : path.join(here, 'build/page'));

/** Generates TypeScript of the messages. */
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

const OPTIONS = {
  bundle: true,
  target: 'es2022',
  minify: !debug,
  sourcemap: debug ? 'inline' : false,
  legalComments: 'none',
  tsconfig: path.join(here, 'tsconfig.json'),
  absWorkingDir: here,
  logLevel: 'warning',
};

/** Replaces {{include FILE}} by a fragment of src/ui. */
function expand(name) {
  return readFileSync(path.join(here, 'src', name), 'utf8').replace(/\{\{include (.*)\}\}\n/g,
    (_, fragment) => readFileSync(path.join(here, 'src/ui', fragment), 'utf8'));
}

async function buildPage() {
  rmSync(out, { recursive: true, force: true });
  mkdirSync(out, { recursive: true });
  await build({
    ...OPTIONS, outdir: out, format: 'esm',
    entryPoints: {
      page: path.join(here, 'src/ui/main.ts'),
      space: path.join(here, 'src/space/renderer.ts'),
      space_worker: path.join(here, 'src/space/worker.ts'),
    },
  });
  writeFileSync(path.join(out, 'index.html'), expand('ui/index.html'));
  cpSync(path.join(here, 'src/ui/icon.svg'), path.join(out, 'icon.svg'));
}

/** The report as one file. The marks that are left are filled in by client/output/report.cc. */
export async function buildReport() {
  const { outputFiles } = await build({
    ...OPTIONS, entryPoints: { report: path.join(here, 'src/report/main.ts') }, outdir: out,
    format: 'iife', charset: 'utf8', write: false,
  });
  const text = (ending) => outputFiles.find((file) => file.path.endsWith(ending)).text.trim();
  const parts = { style: text('.css'), script: text('.js') };
  for (const [name, part] of Object.entries(parts)) {
    if (/\{\{|<\/(script|style)/.test(part)) throw new Error(`the ${name} of the report contains "{{" or "</script"`);
  }
  return expand('report/report.html').replace(/\{\{(style|script)\}\}/g, (_, name) => parts[name]);
}

/** The script that draws the surfaces of a report. */
export async function buildReportSpace() {
  const { outputFiles: [{ text }] } = await build({
    ...OPTIONS, entryPoints: [path.join(here, 'src/report/space_part.ts')], outdir: out, format: 'iife', charset: 'utf8',
    write: false,
  });
  return text;
}

/** A script as text for a document, and the inverse. */
const packedText = (script) => gzipSync(script, { level: 9 }).toString('base64');
export const unpackedText = (text) => gunzipSync(Buffer.from(text, 'base64')).toString('utf8');

function pack() {
  const parts = { page: { total: 0, limit: LIMIT }, 'part for surfaces': { total: 0, limit: SPACE_LIMIT } };
  for (const name of readdirSync(out).sort()) {
    const bytes = readFileSync(path.join(out, name));
    const packed = gzipSync(bytes, { level: 9 });
    writeFileSync(path.join(out, `${name}.gz`), packed);
    parts[SPACE_FILES.includes(name) ? 'part for surfaces' : 'page'].total += packed.length;
    console.log(`${name}: ${bytes.length} bytes, compressed ${packed.length}`);
  }
  for (const [name, { total, limit }] of Object.entries(parts)) {
    console.log(`the ${name}: ${total} bytes compressed, limit ${limit}`);
    if (!debug && total > limit) throw new Error(`the ${name} has ${total} bytes, limit ${limit}`);
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  generate();
  check();
  if (process.argv.includes('--report')) {
    const report = await buildReport();
    writeFileSync(path.join(root, 'client/output/report_page.html'), report);
    const space = packedText(await buildReportSpace());
    writeFileSync(path.join(root, 'client/output/report_space.txt'), space);
    console.log(`the report: ${report.length} characters, with surfaces ${space.length} more`);
    if (report.length > REPORT_LIMIT || space.length > REPORT_SPACE_LIMIT) throw new Error('the report is too large');
  } else {
    await buildPage();
    pack();
  }
}
