// Measures the main thread while the page shows a live surface of about 200,000 triangles: the longest task per frame.
//   node tests/page/measure_space.mjs [--edges]
import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { launch, until, Viewer, World } from './support.mjs';

const SECONDS = 20;
const FRAMES = 4;
/** Balls along each axis, their distance and their radius. */
const [BALLS, APART, RADIUS] = [7, 13, 4.6];

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
  return traceEvents.filter(({ name, ph, pid, tid }) => ph === 'X' && /RunTask$/.test(name) && main.has(`${pid}.${tid}`))
    .map(({ dur = 0, tdur = dur }) => ({ wall: dur / 1000, cpu: tdur / 1000 })).sort((a, b) => a.cpu - b.cpu);
}

const world = await World.start();
const folder = path.join(world.folder, 'many');
mkdirSync(folder);
for (let k = 0; k < FRAMES; ++k) writeFileSync(path.join(folder, `m_${k}.csv`), balls(k));
world.replayOf(folder, 'many', '--surface', '--spacing', '1', '--thinning-distance', '0', '--loop', '--rate', '5', '--coordinates', 'compact');
const browser = await launch();
const look = process.argv.includes('--edges') ? '&look=fill,edges,colour:identity,width:2' : '';
const viewer = await Viewer.open(browser, world.url, { hash: `#stream=many${look}` });
await viewer.shows(2);
await until('frames', () => viewer.frame());
const begin = await viewer.frame();
await browser.startTracing(viewer.page, { categories: ['toplevel', 'devtools.timeline', 'disabled-by-default-devtools.timeline'] });
await sleep(SECONDS * 1000);
const tasks = tasksOf(await browser.stopTracing(), world.url);
const frames = await viewer.frame() - begin;
const numbers = await viewer.numbers();
const at = (share) => tasks[Math.min(tasks.length - 1, Math.floor(share * tasks.length))];
console.log(`${numbers.triangles} triangles, ${numbers.bodies} bodies and cavities; ${frames} frames in ${SECONDS} s`);
console.log(`${tasks.length} tasks of the main thread; CPU ms: median ${at(0.5).cpu.toFixed(2)}, p99 ${at(0.99).cpu.toFixed(2)}, ` +
  `max ${at(1).cpu.toFixed(2)}; above 8 ms: ${tasks.filter(({ cpu }) => cpu > 8).length}`);
console.log(`the longest: ${tasks.slice(-8).map(({ cpu, wall }) => `${cpu.toFixed(1)} (wall ${wall.toFixed(1)})`).join(', ')}`);
await viewer.close();
await browser.close();
await world.close();
