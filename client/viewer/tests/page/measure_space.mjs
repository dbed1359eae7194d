// Measures the main thread while the page steps through frames of about 200,000 triangles: the longest tasks.
//   node tests/page/measure_space.mjs [--edges]
import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { launch, until, Viewer, World } from './support.mjs';

const STEPS = 60;
const STEP_MS = 250;
const FRAMES = 4;
/** The server computes a frame in seconds. */
const SERVER_MS = 400_000;
/** Balls along each axis, their distance and their radius. */
const [BALLS, APART, RADIUS] = [5, 13, 4.6];

function balls(frame) {
  const lines = ['x,y,z'];
  const reach = Math.ceil(RADIUS);
  for (let ball = 0; ball < BALLS ** 3; ++ball) {
    const centre = [ball % BALLS, Math.floor(ball / BALLS) % BALLS, Math.floor(ball / BALLS ** 2)].map((k) => k * APART);
    for (let x = -reach; x <= reach; ++x) {
      for (let y = -reach; y <= reach; ++y) {
        for (let z = -reach; z <= reach; ++z) {
          if (x * x + y * y + z * z > RADIUS * RADIUS) continue;
          lines.push(`${centre[0] + x + 0.2 * frame},${centre[1] + y},${centre[2] + z}`);
        }
      }
    }
  }
  return `${lines.join('\n')}\n`;
}

/** Milliseconds of the tasks of the page's main thread. */
function tasksOf(trace, url) {
  const { traceEvents } = JSON.parse(trace.toString());
  const pages = new Set(traceEvents.filter(({ args }) => args?.data?.frames?.some((frame) => frame.url?.startsWith(url)) ||
    args?.data?.documentLoaderURL?.startsWith(url) || args?.data?.url?.startsWith(url)).map(({ pid }) => pid));
  const main = new Set(traceEvents.filter(({ name, args, pid }) =>
    name === 'thread_name' && args.name === 'CrRendererMain' && (pages.size === 0 || pages.has(pid)))
    .map(({ pid, tid }) => `${pid}.${tid}`));
  const own = traceEvents.filter(({ ph, pid, tid }) => ph === 'X' && main.has(`${pid}.${tid}`));
  const parts = own.filter(({ name }) => !/RunTask$/.test(name));
  return own.filter(({ name }) => /RunTask$/.test(name)).map(({ ts, dur = 0, tdur = dur }) => {
    const longest = parts.filter((part) => part.ts >= ts && part.ts + (part.dur ?? 0) <= ts + dur && (part.tdur ?? 0) > 0.5 * tdur)
      .map(({ name }) => name);
    return { wall: dur / 1000, cpu: tdur / 1000, of: tdur > 4000 ? longest.at(-1) ?? '' : '' };
  }).sort((a, b) => a.cpu - b.cpu);
}

const world = await World.start();
const folder = path.join(world.folder, 'many');
mkdirSync(folder);
for (let k = 0; k < FRAMES; ++k) writeFileSync(path.join(folder, `m_${k}.csv`), balls(k));
const producer = world.replayOf(folder, 'many', '--surface', '--spacing', '1', '--thinning-distance', '0', '--loop', '--rate', '5', '--coordinates', 'compact');
const browser = await launch();
const look = process.argv.includes('--edges') ? '&look=fill,edges,colour:identity,width:2' : '';
const viewer = await Viewer.open(browser, world.url, { hash: `#stream=many${look}` });
const slider = viewer.page.getByLabel('Frame', { exact: true });
await until('frames', async () => Number(await slider.getAttribute('max')) >= FRAMES && await viewer.frame() >= FRAMES, SERVER_MS);
await viewer.button('Pause').click();
await producer.stop();
await sleep(2000);
await browser.startTracing(viewer.page, { categories: ['toplevel', 'devtools.timeline', 'disabled-by-default-devtools.timeline'] });
for (let k = 0; k < STEPS; ++k) {
  await viewer.page.keyboard.press(k % 4 < 2 ? ',' : '.');
  await sleep(STEP_MS);
}
const tasks = tasksOf(await browser.stopTracing(), world.url);
const numbers = await viewer.numbers();
const at = (share) => tasks[Math.min(tasks.length - 1, Math.floor(share * tasks.length))];
console.log(`${numbers.triangles} triangles, ${numbers.bodies} bodies and cavities; ${STEPS} frames`);
console.log(`${tasks.length} tasks of the main thread; CPU ms: median ${at(0.5).cpu.toFixed(2)}, p99 ${at(0.99).cpu.toFixed(2)}, ` +
  `max ${at(1).cpu.toFixed(2)}; above 8 ms: ${tasks.filter(({ cpu }) => cpu > 8).length}`);
console.log(`the longest: ${tasks.slice(-8).map(({ cpu, wall, of }) => `${cpu.toFixed(1)} (wall ${wall.toFixed(1)}, ${of})`).join(', ')}`);
await viewer.close();
await browser.close();
await world.close();
