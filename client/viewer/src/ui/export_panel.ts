import type { Look } from '../draw';
import { clip, download, geojson, marksOf, png, svg } from '../export';
import { NO_WEBGL } from '../draw';
import type { CurveSource } from '../stream/track';
import { curvesCsv } from './curve_data';
import { button, input, setText } from './dom';
import type { Pane } from './pane';

const TITLES: Record<string, string> = {
  'export-png': 'Saves the picture with legend, scale and time in pixels.',
  'export-clip': 'Records the picture as a video until the next click.',
};

export const NO_PICTURE = 'No picture yet. Choose a stream or drop files.';

/** Exports the picture of the chosen pane, and a link to it. */
export class ExportPanel {
  private recording: { clip: ReturnType<typeof clip>; pane: Pane } | null = null;

  constructor(private readonly pane: () => Pane | null, private readonly look: () => Look,
              private readonly report: (text: string, isError: boolean, isGone?: () => boolean) => void) {
    this.on('export-png', async (shown) => download(this.name(shown, 'png'), await png(shown.scene, this.marks(shown))));
    this.on('export-svg', async (shown) => {
      if (!shown.frame) return;
      const { view, size } = shown.scene;
      const text = svg(shown.frame, this.look(), view, size, shown.scene.legend(),
        shown.scene.selectedRings, this.marks(shown));
      download(this.name(shown, 'svg'), new Blob([text], { type: 'image/svg+xml' }));
    });
    this.on('export-geojson', async (shown) => {
      if (!shown.frame) return;
      const blob = new Blob([geojson(shown.frame)], { type: 'application/geo+json' });
      download(this.name(shown, 'geojson'), blob);
    });
    this.on('export-csv', async ({ track, curves }) => downloadCurves(curves, track.title));
    this.on('export-clip', (shown) => this.toggleClip(shown));
    this.on('copy-link', async () => {
      await this.copyLink();
    });
  }

  /** Offers only what the browser can export. */
  offer(hasWebgl: boolean): void {
    for (const id of ['export-png', 'export-clip']) {
      button(id).disabled = !hasWebgl;
      button(id).title = hasWebgl ? TITLES[id] : `${NO_WEBGL} Save the picture as SVG.`;
    }
  }

  /** Browsers allow a page to copy only by HTTPS or from this machine. */
  private async copyLink(): Promise<void> {
    const field = input('link');
    try {
      if (!navigator.clipboard) throw new Error('no clipboard');
      await navigator.clipboard.writeText(location.href);
      field.hidden = true;
      this.report('Link copied.', false);
    } catch {
      field.value = location.href;
      field.hidden = false;
      field.select();
      this.report('The browser does not let this page copy. Copy the selected link under Export.', true,
                  () => field.hidden);
    }
  }

  private on(id: string, act: (pane: Pane) => Promise<void>): void {
    button(id).addEventListener('click', () => {
      const pane = this.pane();
      if (!pane?.frame) {
        this.report(NO_PICTURE, true, () => this.pane()?.frame != null);
        return;
      }
      act(pane).catch((error: unknown) => {
        this.report(error instanceof Error ? error.message : String(error), true);
      });
    });
  }

  private async toggleClip(pane: Pane): Promise<void> {
    const running = this.recording;
    if (running) {
      this.recording = null;
      this.showRecording();
      download(this.name(running.pane, 'webm'), await running.clip.stop());
    } else {
      const started = clip(pane.scene, () => this.marks(pane));
      started.start();
      this.recording = { clip: started, pane };
      this.showRecording();
    }
  }

  private showRecording(): void {
    const isOn = this.recording !== null;
    button('export-clip').setAttribute('aria-pressed', String(isOn));
    setText(button('export-clip'), isOn ? 'Stop and save' : 'Record clip');
  }

  /** Caption, scale and legend of the picture. */
  private marks({ scene, caption }: Pane) {
    return marksOf(caption, scene.size, scene.view, scene.legend(), this.look().dark);
  }

  private name(pane: Pane, suffix: string): string {
    return `${fileName(pane.track.title)}_${pane.track.labelOf(Number(pane.frame?.sequence ?? 0))}.${suffix}`;
  }
}

/** Saves the numbers of all frames of a track. */
export function downloadCurves(track: CurveSource, title: string): void {
  download(`${fileName(title)}_curves.csv`, new Blob([curvesCsv(track)], { type: 'text/csv' }));
}

function fileName(title: string): string {
  return title.replace(/[^A-Za-z0-9._-]+/g, '_').slice(0, 60);
}
