import type { Look } from '../draw';
import { clip, type Clip, download, geojson, marksOf, png, svg } from '../export';
import { NO_WEBGL } from '../draw';
import type { Gauges } from '../gauges/gauges';
import type { CurveSource } from '../stream/track';
import { curvesCsv } from './curve_data';
import { block, button, input, setText } from './dom';
import type { Pane } from './pane';

const OF_OUTLINES = 'A surface has no outline to save, so choose a section under "Picture of" first.';
const PNG_TITLE = 'Saves the picture with legend, scale and time in pixels.';

/** State of the button that records. A running recording can always be stopped. */
export function clipButton(isRecording: boolean, isOnCanvas: boolean): { text: string; title: string; isDisabled: boolean } {
  if (isRecording) {
    return { text: 'Stop and save', title: 'Ends the recording and saves the video.', isDisabled: false };
  }
  return {
    text: 'Record clip', isDisabled: !isOnCanvas,
    title: isOnCanvas ? 'Records the picture as a video until the next click.' : `${NO_WEBGL} Save the picture as SVG.`,
  };
}

export const NO_PICTURE = 'No picture yet. Choose a stream or drop files.';

/** Exports the picture of the chosen pane, and a link to it. */
export class ExportPanel {
  private recording: { clip: Clip; pane: Pane } | null = null;

  constructor(private readonly pane: () => Pane | null, private readonly look: () => Look, gauges: Gauges,
              private readonly report: (text: string, isError: boolean, isGone?: () => boolean) => void) {
    this.on('export-png', async (shown) => download(this.name(shown, 'png'), await png(shown.drawn, this.marks(shown))));
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
    this.on('export-csv', async ({ track, curves, hasSurfaces }) => {
      downloadCurves(curves, track.title, gauges, hasSurfaces);
    });
    button('export-clip').addEventListener('click', () => {
      // Works without a chosen picture, because the recorded one may be closed by now.
      if (this.recording) this.run(this.stopClip(this.recording));
      else this.withPicture(async (shown) => this.startClip(shown));
    });
    this.on('copy-link', async () => {
      await this.copyLink();
    });
  }

  /** Enables the exports that the browser and the kind of picture allow. */
  offer(isOnCanvas: boolean, isSpace: boolean): void {
    for (const id of ['export-svg', 'export-geojson']) block(button(id), isSpace ? OF_OUTLINES : '');
    const png = button('export-png');
    png.disabled = !isOnCanvas;
    png.title = isOnCanvas ? PNG_TITLE : `${NO_WEBGL} Save the picture as SVG.`;
    const { text, title, isDisabled } = clipButton(this.recording !== null, isOnCanvas);
    const clipOf = button('export-clip');
    clipOf.disabled = isDisabled;
    clipOf.title = title;
    clipOf.setAttribute('aria-pressed', String(this.recording !== null));
    setText(clipOf, text);
  }

  /** Copies the link, or shows it. Browsers allow a page to copy only by HTTPS or from this machine. */
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
    button(id).addEventListener('click', () => this.withPicture(act));
  }

  private withPicture(act: (pane: Pane) => Promise<void>): void {
    const pane = this.pane();
    if (pane?.frame) this.run(act(pane));
    else this.report(NO_PICTURE, true, () => this.pane()?.frame != null);
  }

  private run(action: Promise<void>): void {
    action.catch((error: unknown) => {
      this.report(error instanceof Error ? error.message : String(error), true);
    });
  }

  private startClip(pane: Pane): void {
    const started = clip(pane.drawn, () => this.marks(pane));
    started.start();
    this.recording = { clip: started, pane };
  }

  private async stopClip({ clip: running, pane }: { clip: Clip; pane: Pane }): Promise<void> {
    this.recording = null;
    download(this.name(pane, 'webm'), await running.stop());
  }

  /** Caption, scale, legend, axes, contacts and measurement of the picture. */
  private marks(pane: Pane) {
    const { dark } = this.look();
    const { scene, caption, overlaid } = pane;
    return pane.spaceMarks(dark) ?? marksOf(caption, scene.size, scene.view, scene.legend(), dark, overlaid);
  }

  private name(pane: Pane, suffix: string): string {
    return `${fileName(pane.track.title)}_${pane.track.labelOf(Number(pane.frame?.sequence ?? 0))}.${suffix}`;
  }
}

/** Saves the numbers of all frames of a track. */
export function downloadCurves(track: CurveSource, title: string, gauges: Gauges, isSpace = false): void {
  download(`${fileName(title)}_curves.csv`, new Blob([curvesCsv(track, gauges, isSpace)], { type: 'text/csv' }));
}

function fileName(title: string): string {
  return title.replace(/[^A-Za-z0-9._-]+/g, '_').slice(0, 60);
}
