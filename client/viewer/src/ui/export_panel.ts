import type { Look } from '../draw';
import { clip, download, geojson, png, svg } from '../export';
import { button, setText } from './dom';
import type { Pane } from './pane';

/** Exports the picture of the chosen pane, and a link to it. */
export class ExportPanel {
  private recording: ReturnType<typeof clip> | null = null;

  constructor(private readonly pane: () => Pane | null, private readonly look: () => Look,
              private readonly report: (text: string, isError: boolean) => void) {
    this.on('export-png', async (shown) => download(this.name(shown, 'png'), await png(shown.scene)));
    this.on('export-svg', async (shown) => {
      if (!shown.frame) return;
      const text = svg(shown.frame, this.look(), shown.scene.view, shown.scene.size);
      download(this.name(shown, 'svg'), new Blob([text], { type: 'image/svg+xml' }));
    });
    this.on('export-geojson', async (shown) => {
      if (!shown.frame) return;
      const blob = new Blob([geojson(shown.frame)], { type: 'application/geo+json' });
      download(this.name(shown, 'geojson'), blob);
    });
    this.on('export-clip', (shown) => this.toggleClip(shown));
    this.on('copy-link', async () => {
      await navigator.clipboard.writeText(location.href);
      this.report('Link copied.', false);
    });
  }

  private on(id: string, act: (pane: Pane) => Promise<void>): void {
    button(id).addEventListener('click', () => {
      const pane = this.pane();
      if (!pane?.frame) {
        this.report('No picture yet. Choose a stream or drop files.', true);
        return;
      }
      act(pane).catch((error: unknown) => {
        this.report(error instanceof Error ? error.message : String(error), true);
      });
    });
  }

  private async toggleClip(pane: Pane): Promise<void> {
    const isOn = this.recording !== null;
    if (this.recording) {
      const blob = await this.recording.stop();
      this.recording = null;
      download(this.name(pane, 'webm'), blob);
    } else {
      this.recording = clip(pane.scene.canvas);
      this.recording.start();
    }
    button('export-clip').setAttribute('aria-pressed', String(!isOn));
    setText(button('export-clip'), isOn ? 'Record clip' : 'Stop and save');
  }

  private name(pane: Pane, suffix: string): string {
    const title = pane.track.title.replace(/[^A-Za-z0-9._-]+/g, '_').slice(0, 60);
    return `${title}_${pane.frame?.sequence ?? 0}.${suffix}`;
  }
}
