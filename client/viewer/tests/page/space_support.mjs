// A stream of surfaces for the page's tests, and the page that shows it.
import { existsSync, mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { before } from 'node:test';
import { cleansUp, launch, moduleOf, until, Viewer, World } from './support.mjs';

const { parseSpaceView, project } = await moduleOf('src/space/camera.ts');

/** Options of the reconstruction. */
export const SURFACE = ['--surface', '--spacing', '1', '--attributes', 'p'];
export const FRAMES = 8;

/** Two balls that approach each other and merge; the first one has a cavity. */
function balls(frame) {
  const lines = ['x,y,z,p'];
  for (const [centre, speed] of [[-8, 1], [8, -1]]) {
    for (let x = -6; x <= 6; ++x) {
      for (let y = -6; y <= 6; ++y) {
        for (let z = -6; z <= 6; ++z) {
          const square = x * x + y * y + z * z;
          if (square > 36 || (centre < 0 && square < 9)) continue;
          lines.push([x + centre + speed * frame * 0.4, y, z, x + y].join(','));
        }
      }
    }
  }
  return `${lines.join('\n')}\n`;
}

/** The folder of the frames in `world.folder`, which the first call writes. */
export function ballsOf(world) {
  const folder = path.join(world.folder, 'balls');
  if (existsSync(folder)) return folder;
  mkdirSync(folder);
  for (let k = 0; k < FRAMES; ++k) writeFileSync(path.join(folder, `b_${k}.csv`), balls(k));
  return folder;
}

/** Streams the balls in a loop. Returns the producer. */
export function streamBalls(world, name = 'balls', format = 'compact') {
  return world.replayOf(ballsOf(world), name, ...SURFACE, '--echo-particles', '--slice', 'z=0', '--slice', 'y=2',
    '--loop', '--rate', '5', '--coordinates', format);
}

/** Starts a server with the stream `balls`, and Chromium, before all tests, and closes them after all.
 * Returns both as { world, browser }, which are set then. `viewer`: returns the page that is open. */
export function servesBalls(viewer) {
  const opened = {};
  before(async () => {
    opened.world = await World.start();
    streamBalls(opened.world);
    opened.browser = await launch();
  });
  cleansUp(() => ({ ...opened, viewer: viewer() }));
  return opened;
}

/** The page with pictures of surfaces. */
export class SpaceViewer extends Viewer {
  /** The page once it shows the balls. */
  static async ofBalls(browser, url, options = {}) {
    const it = await SpaceViewer.open(browser, url, { hash: '#stream=balls', ...options });
    await it.drawsSurface();
    return it;
  }

  async drawsSurface() {
    await this.shows();
    await until('the surface is drawn', () => this.isDrawn());
  }

  space(k = 0) { return this.pane(k).locator('.space canvas'); }

  /** Whether the picture has more than its background. */
  async isDrawn(k = 0) { return (await this.pixelsOf(this.space(k))).length > 6000; }

  /** Pauses at the first frame of the recording that the server holds. */
  async pauseAtFirst() {
    await this.button('Pause').click();
    const first = Number(await this.page.getByLabel('Frame', { exact: true }).getAttribute('min'));
    const begin = first + (FRAMES - (first - 1) % FRAMES) % FRAMES;
    await this.goTo(begin);
    await this.still();
    return begin;
  }

  /** Goes to a frame of the stream, which may not have arrived yet. */
  async goTo(frame) {
    const slider = this.page.getByLabel('Frame', { exact: true });
    await until(`frame ${frame} arrives`, async () => Number(await slider.getAttribute('max')) >= frame);
    await this.scrubTo(frame);
  }

  /** Waits until the picture no longer changes. */
  async still(k = 0) {
    let last = '';
    await until('the picture is still', async () => {
      await this.refreshes();
      const now = await this.picture(k);
      const isSame = now === last;
      last = now;
      return isSame;
    });
    return last;
  }

  /** Does something, and waits until the picture differs. */
  async changes(what, act, k = 0) {
    const before = await this.still(k);
    await act();
    await until(`${what} changes the picture`, async () => await this.picture(k) !== before);
  }

  /** Where a paused picture shows a point, by the camera in the page's address. */
  async placeOf(point) {
    const { width, height } = await this.space().boundingBox();
    const view = parseSpaceView(new URLSearchParams(new URL(this.page.url()).hash.slice(1)).get('camera'));
    return project({ view, isPerspective: true, size: { width, height } }, point);
  }
}
