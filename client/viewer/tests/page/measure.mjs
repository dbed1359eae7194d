// Measures the page and the gateway, and prints figures with their targets. Not a test: figures depend
// on the machine and its load.
//   node tests/page/measure.mjs [--minutes N]     duration of the heap measurement, default 20
import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { parseArgs } from 'node:util';
import { BareChromium } from './bare_chromium.mjs';
import { until, World } from './support.mjs';

const { values: options } = parseArgs({ options: { minutes: { type: 'string', default: '20' } } });
const say = (what, figure, wanted) => console.log(`${what}: ${figure} (wanted: ${wanted})`);

/** CSV files of a pulsating disc of about `particles`. */
function writeFrames(folder, particles, frames) {
  mkdirSync(folder, { recursive: true });
  const radius = Math.sqrt(particles / Math.PI);
  for (let k = 0; k < frames; ++k) {
    const lines = ['x,y'];
    for (let i = Math.ceil(-radius); i <= radius; ++i) {
      for (let j = Math.ceil(-radius); j <= radius; ++j) {
        if (i * i + j * j > radius * radius) continue;
        const wave = 0.3 * Math.sin(0.2 * i + 2 * Math.PI * k / frames);
        lines.push(`${i},${(j + wave).toFixed(4)}`);
      }
    }
    writeFileSync(path.join(folder, `f_${k}.csv`), `${lines.join('\n')}\n`);
  }
}

async function recordingOf(world, particles) {
  const folder = path.join(world.folder, `frames_${particles}`);
  const file = path.join(world.folder, `${particles}.pemc`);
  writeFrames(folder, particles, 20);
  await world.convert(folder, file, '--spacing', '1');
  return file;
}

/** In the page: milliseconds from opening to the first frame. */
const firstFrame = () => new Promise((resolve) => {
  const look = () => {
    const frame = Number(document.querySelector('[data-key="frame"]')?.textContent);
    if (frame > 0) resolve(performance.now());
    else requestAnimationFrame(look);
  };
  look();
});

/** In the page: milliseconds until a frame of the history is shown, for `count` frames. */
const scrub = async (count) => {
  const slider = document.querySelector('#scrub');
  const cell = document.querySelector('[data-key="frame"]');
  const times = [];
  for (let k = 0; k < count; ++k) {
    const [min, max] = [Number(slider.min), Number(slider.max)];
    const place = Math.floor(min + Math.random() * (max - min));
    const begin = performance.now();
    slider.value = String(place);
    slider.dispatchEvent(new Event('input'));
    while (Number(cell.textContent) !== place) {
      if (performance.now() - begin > 2000) throw new Error(`${place} is not shown, but ${cell.textContent}`);
      await new Promise(requestAnimationFrame);
    }
    times.push(performance.now() - begin);
  }
  times.sort((a, b) => a - b);
  return { p50: times[count >> 1], most: times[count - 1] };
};

/** In the page: reads the history of a stream for some seconds, and returns the rate. */
const drain = async (stream) => {
  const socket = new WebSocket(location.origin.replace('http', 'ws') + '/v1/watch', ['partiemc.v1']);
  socket.binaryType = 'arraybuffer';
  const name = new TextEncoder().encode(stream);
  // Bytes of the Protobuf message OpenWatch: stream_name, mode every, credits 64, from_sequence 0.
  const open = [0x0a, name.length, ...name, 0x10, 2, 0x18, 64, 0x20, 0];
  socket.onopen = () => socket.send(new Uint8Array([0x0a, open.length, ...open]));
  let [messages, bytes, begin, end] = [0, 0, 0, 0];
  await new Promise((resolve) => {
    socket.onmessage = ({ data }) => {
      end = performance.now();
      begin ||= end;
      if (typeof data === 'string') return;
      messages++;
      bytes += data.byteLength;
      socket.send(new Uint8Array([0x12, 2, 0x08, 1]));  // WatchCredit: 1.
      if (messages === 4000 || end - begin > 5000) resolve();
    };
    setTimeout(resolve, 6000);
  });
  socket.close();
  const seconds = (end - begin) / 1000;
  return { size: bytes / messages, messages, perSecond: messages / seconds, rate: bytes / seconds / 1e6 };
};

async function withPage(world, hash, measure) {
  const browser = new BareChromium();
  try {
    await browser.open(world.url + hash);
    await measure(browser);
  } finally {
    await browser.close();
  }
}

async function measureMessages() {
  for (const [particles, fill] of [[12, 'none'], [450, 'greedy'], [5000, 'grid'], [50_000, 'grid']]) {
    const world = await World.start('--history-bytes', '256MiB', '--max-watcher-bytes', '512MiB');
    try {
      const file = await recordingOf(world, particles);
      const producer = world.replayOf(file, 'many', '--loop', '--rate', 'max', '--fill', fill, '--echo-particles');
      await sleep(8000);
      producer.rest();  // Reads the server's history at full speed.
      await withPage(world, 'icon.svg', async (browser) => {
        await sleep(500);
        const { size, messages, perSecond, rate } = await browser.evaluate(drain, 'many');
        say(`messages of ${(size / 1000).toFixed(1)} kB`, `${perSecond.toFixed(0)}/s, ${rate.toFixed(0)} MB/s over ${messages}`,
            '200/s or 300 MB/s');
      });
      await producer.stop();
    } finally {
      await world.close();
    }
  }
}

/** In the page, for `duration` milliseconds: frames received and drawn per second, and the 99th percentile of the time
 * between two refreshes of the screen, in milliseconds. `dropped`: frames since the page opened that the server has skipped. */
const follow = async (duration) => {
  const counts = () => {
    const caption = [...document.querySelectorAll('figcaption')].find(({ textContent }) => /^Frames /.test(textContent));
    const count = (name) => Number(new RegExp(`${name} ([\\d,]+)`).exec(caption.textContent)[1].replaceAll(',', ''));
    return { received: count('received'), drawn: count('drawn'), dropped: count('dropped') };
  };
  const times = [];
  const before = counts();
  const begin = performance.now();
  do times.push(await new Promise(requestAnimationFrame));
  while (performance.now() - begin < duration);
  const after = counts();
  const seconds = (performance.now() - begin) / 1000;
  const gaps = times.slice(1).map((time, k) => time - times[k]).sort((a, b) => a - b);
  return {
    received: (after.received - before.received) / seconds, drawn: (after.drawn - before.drawn) / seconds,
    dropped: after.dropped, p99: gaps[Math.floor(0.99 * gaps.length)],
  };
};

async function measureThroughput() {
  const world = await World.start();
  try {
    const file = await recordingOf(world, 10_000);
    world.replayOf(file, 'fast', '--loop', '--rate', '200');
    await sleep(2000);
    let lost = 0;
    await withPage(world, '#stream=fast', async (browser) => {
      await browser.evaluate(firstFrame);
      await sleep(2000);
      const { received, drawn, dropped, p99 } = await browser.evaluate(follow, 10_000);
      lost = dropped;
      say('received from 2 s after the first frame on', `${received.toFixed(0)} frames/s`, '200');
      say('drawn', `${drawn.toFixed(0)} frames/s, p99 ${p99.toFixed(0)} ms between two refreshes`, '60 frames/s, 17 ms');
    });
    const logged = (event) => world.log.join('').match(new RegExp(`watch ${event}`, 'g'))?.length ?? 0;
    await until('all watches are logged', () => logged('closed') > 0 && logged('closed') === logged('opened'));
    const watches = world.log.join('').match(/watch closed.*/g)
      .map((line) => /frames=(\d+) dropped=(\d+).* seconds=([\d.]+).* reason=(\S+)/.exec(line))
      .map(([, frames, dropped, seconds, reason]) => ({ frames, dropped, seconds, reason }));
    // In the log, `dropped` counts all frames that the server has not sent: those the page lost, and those that waited
    // for credit when the page closed. The page's other watches read the history up to a frame, and close.
    const live = watches.sort((a, b) => b.seconds - a.seconds)[0];
    say('10k particles at 200 frames/s', `${(live.frames / live.seconds).toFixed(0)} frames/s, ${lost} lost, ` +
        `${live.dropped - lost} not sent yet at the end, ` +
        `${watches.filter(({ reason }) => reason === 'FELL_BEHIND').length} times behind`, '200, 0 lost, 0 times behind');
  } finally {
    await world.close();
  }
}

async function measurePage() {
  const world = await World.start();
  try {
    world.loop('dam', '--rate', '60');
    await sleep(3000);
    await withPage(world, '', async (browser) => {
      say('first frame after opening', `${(await browser.evaluate(firstFrame)).toFixed(0)} ms`, 'at most 1000');
      await sleep(5000);
      const { p50, most } = await browser.evaluate(scrub, 60);
      say('scrub', `p50 ${p50.toFixed(1)} ms, most ${most.toFixed(1)} ms`, 'at most 50');
      await world.killServer();
      await sleep(1000);
      await world.startServer();
      const begin = Date.now();
      const place = () => browser.evaluate(() => document.querySelector('#status').textContent);
      await browser.evaluate(() => document.querySelector('#live').click());
      await until('it is live again', async () => await place() === 'Live');
      say('live after the server is back', `${Date.now() - begin} ms`, 'at most 3000');
      await measureHeap(browser);
    });
  } finally {
    await world.close();
  }
}

async function measureHeap(browser) {
  const minutes = Number(options.minutes);
  const sizes = [];
  for (let k = 0; k <= 2 * minutes; ++k) {
    await browser.send('HeapProfiler.collectGarbage');
    sizes.push(await browser.evaluate(() => performance.memory.usedJSHeapSize) / 1e6);
    if (k < 2 * minutes) await sleep(30_000);
  }
  const text = sizes.map((size) => size.toFixed(1)).join(' ');
  say(`heap over ${minutes} min at 60 frames/s, every 30 s`, `${text} MB`, 'flat within 10 % once history is full');
}

await measureMessages();
await measureThroughput();
await measurePage();
