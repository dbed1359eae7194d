// The script of `partiemc replay --report`: the frames in the document, drawn by the page's parts.
import 'uplot/dist/uPlot.min.css';
import './report.css';
import { Gauges } from '../gauges/gauges';
import { AS_STREAMED } from '../stream/settings';
import { addressText, parseAddress } from '../ui/address';
import { CurvesPanel, RESULT_CURVES } from '../ui/curves_panel';
import { button, byId, setText } from '../ui/dom';
import { releaseFocusAfterClicks, usesKey } from '../ui/keys';
import { LookPanel, type Switch } from '../ui/look_panel';
import { downloadCurves } from '../ui/export_panel';
import { Pane } from '../ui/pane';
import { SpacePanel } from '../ui/space_panel';
import { StatusLine } from '../ui/status_line';
import { TextPace } from '../ui/text_pace';
import { axesOf } from '../space/camera';
import { Theme } from '../ui/theme';
import { TimePanel } from '../ui/time_panel';
import { reportOutlines } from './outlines';
import { bytesOfBase64 } from './reader';
import type { SpacePart } from './space_part';
import { ReportTrack } from './track';

/** Keys that switch a part of the picture. */
const LAYER_KEYS: Record<string, Switch> = {
  o: 'outline', m: 'edges', p: 'particles', n: 'normals', i: 'sections',
};

/** Names in links to reports of earlier versions: `#layers=outline,mesh`. */
const FORMER_LAYERS: Record<string, string> = { mesh: 'edges', colors: '', isolines: 'sections' };

/** Reads the frames that client/output/report.cc has written into the document. */
function trackOfDocument(spacePart: SpacePart | null): ReportTrack {
  const scripts = (name: string) => [...document.querySelectorAll(`script.${name}`)];
  const geometries = scripts('frame-geometry');
  const rows = [...document.querySelectorAll<HTMLTableRowElement>('table.parameters tr')];
  const parameter = (name: string) =>
    rows.find((row) => row.cells[0].textContent === name)?.cells[1].textContent ?? '';
  return new ReportTrack(
    document.querySelector('h1')?.textContent ?? '',
    { placement: parameter('placement'), fill: parameter('fill') },
    document.body.dataset.color ?? '',
    reportOutlines(rows.map(({ cells: [name, value] }) => [name.textContent ?? '', value.textContent ?? ''])),
    scripts('frame-numbers').map((script) => JSON.parse(script.textContent ?? '')),
    (index) => geometries[index].textContent ?? '', spacePart);
}

/** The part of the report that draws surfaces; null if there is none, or if the browser cannot unpack it. */
async function loadSpacePart(): Promise<SpacePart | null> {
  const packed = document.getElementById('space-part')?.textContent;
  if (!packed || !('DecompressionStream' in globalThis)) return null;
  const unpacked = new Blob([bytesOfBase64(packed.trim())]).stream().pipeThrough(new DecompressionStream('gzip'));
  const script = document.createElement('script');
  script.textContent = await new Response(unpacked).text();
  document.head.append(script);
  return (globalThis as { partiemcSpacePart?: SpacePart }).partiemcSpacePart ?? null;
}

class Report {
  private readonly track: ReportTrack;
  private readonly look = new LookPanel(() => this.lookChanged());
  private readonly space: SpacePanel;
  private readonly pane: Pane;
  private readonly time: TimePanel;
  private readonly curves: CurvesPanel;
  private readonly status = new StatusLine();
  private readonly pace = new TextPace();
  private ownAddress = '';
  /** Whether the address has been read. Until then the report must not overwrite the address. */
  private isReady = false;

  constructor(spacePart: SpacePart | null) {
    this.track = trackOfDocument(spacePart);
    this.pane = new Pane(this.track, { ...AS_STREAMED }, {
      chosen: () => {}, closed: () => {}, moved: () => this.writeAddress(),
    }, null, spacePart && ((events) => spacePart.pictureOf(events)));
    this.space = new SpacePanel(() => {
      this.pane.setSpaceLook(this.space.look);
      this.writeAddress();
    }, () => this.pane.spaceView && axesOf(this.pane.spaceView.view).back);
    this.pane.setIndex(0, 1, true);
    byId('stage', HTMLElement).append(this.pane.element);
    this.time = new TimePanel(() => this.track, () => {
      this.pane.numbers.write();
      this.writeAddress();
    });
    this.curves = new CurvesPanel(RESULT_CURVES, true, (sequence) => {
      this.track.player.seek(sequence);
      this.writeAddress();
    });
    new Theme((dark) => {
      this.look.setDark(dark);
      this.curves.setDark(dark);
    });
    const { color, colorRanges } = this.track;
    if (!this.track.hasSurfaces) {
      this.look.setAttributes([...colorRanges.keys()], null);
      this.look.setColour(colorRanges.has(color) ? color : 'plain');
      this.look.toggle('edges');
    } else if (color) {
      this.look.setColour(color);
    }
    this.curves.setKind(this.track.hasSurfaces ? 'space' : 'plane');
    for (const element of document.querySelectorAll<HTMLElement>('[data-of]')) {
      element.hidden = (element.dataset.of === 'space') !== this.track.hasSurfaces;
    }
    setText(byId('space-help', HTMLElement), 'Drag turns, with Shift it pans. The wheel with Ctrl zooms. A click selects a body.');
    this.listen();
    this.readAddress();
    this.isReady = true;
    addEventListener('hashchange', () => {
      if (location.hash !== this.ownAddress) this.readAddress();
    });
    requestAnimationFrame((now) => this.refresh(now));
  }

  private listen(): void {
    const zoom = (key: string) => {
      this.pane.zoom(key);
      this.writeAddress();
    };
    button('zoom-in').addEventListener('click', () => zoom('+'));
    button('zoom-out').addEventListener('click', () => zoom('-'));
    button('export-csv').addEventListener('click', () => downloadCurves(this.track, this.track.title, new Gauges(), this.track.hasSurfaces));
    button('fit').addEventListener('click', () => this.pane.fit());
    addEventListener('beforeprint', () => this.pane.drawn.draw());
    const actions: Record<string, () => void> = {
      ' ': () => this.time.toggle(),
      ',': () => this.time.step(-1), ArrowLeft: () => this.time.step(-1),
      '.': () => this.time.step(1), ArrowRight: () => this.time.step(1),
      Home: () => this.time.jump(-1), End: () => this.time.jump(1),
      f: () => this.pane.fit(), 0: () => this.pane.fit(),
      '+': () => zoom('+'), '=': () => zoom('+'), '-': () => zoom('-'),
      c: () => this.toggleColour(),
      ...Object.fromEntries(Object.entries(LAYER_KEYS).map(([key, name]) => [key, () => this.look.toggle(name)])),
    };
    releaseFocusAfterClicks();
    // Captures the event before the focused picture receives it, so that arrow keys step through
    // frames instead of panning.
    addEventListener('keydown', (event) => {
      const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!action || event.shiftKey || usesKey(event.target, event)) return;
      event.preventDefault();
      event.stopPropagation();
      action();
    }, { capture: true });
  }

  private toggleColour(): void {
    const { color, colorRanges, hasSurfaces } = this.track;
    if (color && (hasSurfaces || colorRanges.has(color))) this.look.setColour(this.look.look.colour === color ? 'plain' : color);
  }

  private lookChanged(): void {
    if (!this.pane) return;
    this.pane.scene.fixedRange = this.track.colorRanges.get(this.look.look.colour) ?? null;
    this.pane.setLook(this.look.look);
    this.writeAddress();
  }

  /** Reads `#frame=12&view=1,2,300&look=...`. `play=1` starts playing. */
  private readAddress(): void {
    const address = parseAddress(location.hash);
    const values = new URLSearchParams(location.hash.slice(1));
    const layers = values.get('layers')?.split(',').map((name) => FORMER_LAYERS[name] ?? name);
    this.look.text = layers ? [...layers, 'fill', `colour:${this.look.look.colour}`].join(',') : address.look;
    if (address.view) this.pane.setView(address.view);
    if (address.camera) this.pane.setSpaceView(address.camera);
    if (address.space) this.space.text = address.space;
    const { player } = this.track;
    player.seek(address.frame === null ? player.sequence ?? 1 : this.track.sequenceOf(address.frame));
    if (values.get('play') === '1') player.play();
  }

  private writeAddress(): void {
    const { player } = this.track;
    if (!this.isReady || player.mode !== 'paused' || player.sequence === null) return;
    const camera = this.pane.spaceView;
    this.ownAddress = addressText({
      panes: [], file: '', open: '', frame: Number(this.track.labelOf(player.sequence)),
      view: this.pane.isFree ? null : this.pane.scene.view, look: this.look.text,
      camera: camera?.isMoved ? camera.view : null, space: this.space.text,
    });
    try {
      history.replaceState(null, '', this.ownAddress);
    } catch {
      // Some browsers refuse history.replaceState for local files. The report works without it.
    }
  }

  private refresh(now: number): void {
    const { player } = this.track;
    this.pace.begin(now);
    player.tick(now);
    this.pane.refresh(this.pace);
    this.time.refresh(this.pace);
    this.curves.refresh(this.track, null, this.pane.summary, this.pane.isStreamed, this.pace);
    if (this.track.hasSurfaces) this.look.setAttributes(this.pane.channels, this.track);
    this.look.offer(this.pane.frame, this.track.kind, this.pane.scene.isOnCanvas, this.pane.isSpace);
    this.space.offer(this.pane.isSpace, this.pane.outlines.length > 1);
    this.look.setOutlines(this.track.outlines);
    this.look.setLegend(this.pane.legend);
    this.status.refresh([this.pane.state], 0, this.track, now);
    setText(byId('omissions', HTMLElement), this.track.omissions(player.sequence ?? 0));
    document.body.dataset.frame = this.track.labelOf(player.sequence ?? 0);
    requestAnimationFrame((next) => this.refresh(next));
  }
}

void loadSpacePart().catch(() => null).then((spacePart) => new Report(spacePart));
