import { Gauges } from '../gauges/gauges';
import { Gateway } from '../stream/gateway';
import { NO_OPTIONS, optionsText, parseOptions } from '../input/options';
import type { FrameSource } from '../input/source';
import { axesOf } from '../space/camera';
import { FileTrack } from '../stream/file_track';
import { AS_STREAMED, type Settings } from '../stream/settings';
import type { Track } from '../stream/track';
import { WatchTrack } from '../stream/watch_track';
import { addressText, parseAddress, type Address } from './address';
import { CurvesPanel, RESULT_CURVES, STREAM_CURVES } from './curves_panel';
import { button, byId, input } from './dom';
import { ExportPanel, NO_PICTURE } from './export_panel';
import { FilesPanel, type OpenFile } from './files_panel';
import { GaugesPanel } from './gauges_panel';
import { releaseFocusAfterClicks, usesKey } from './keys';
import { Layout } from './layout';
import { LookPanel } from './look_panel';
import type { Pane } from './pane';
import { SettingsPanel } from './settings_panel';
import { SpacePanel } from './space_panel';
import { Stage } from './stage';
import { StatusLine } from './status_line';
import { StreamsPanel } from './streams_panel';
import { TextPace } from './text_pace';
import { Theme } from './theme';
import { TimeLink } from './time_link';
import { TimePanel } from './time_panel';

const TOKEN_KEY = 'partiemc-token';
/** Time for gauges in each refresh of the screen. */
const GAUGES_MS = 3;

/** The page: connects the controls with the tracks on the stage. */
export class App {
  private readonly gateway = new Gateway(new URL(location.origin));
  private readonly layout = new Layout();
  private readonly status = new StatusLine();
  private readonly link = new TimeLink();
  private readonly pace = new TextPace();
  private readonly gauges = new Gauges();
  private readonly look: LookPanel;
  private readonly space: SpacePanel;
  private readonly settings: SettingsPanel;
  private readonly stage: Stage;
  private readonly streams: StreamsPanel;
  private readonly time: TimePanel;
  private readonly curves: CurvesPanel;
  private readonly exports: ExportPanel;
  private readonly files: FilesPanel;
  private readonly gaugesPanel: GaugesPanel;
  /** The files of tracks. */
  private readonly opened = new Map<Track, OpenFile>();
  /** The address that was read or written last. */
  private address = '';
  /** False until the address has been read, which must not be overwritten before. */
  private isReady = false;
  /** Frame of the link, until it is shown. */
  private linkedFrame: number | null = null;
  /** The link to a file that the user has not opened yet. */
  private linkedFile: Address | null = null;

  constructor() {
    this.gateway.token = sessionStorage.getItem(TOKEN_KEY) ?? '';
    this.look = new LookPanel(() => this.lookChanged());
    this.stage = new Stage(this.gateway, this.look.look, {
      chosen: () => this.chosenChanged(),
      moved: () => this.writeAddress(),
      released: (track) => this.released(track),
    });
    this.space = new SpacePanel(() => {
      this.stage.setSpaceLook(this.space.look);
      this.writeAddress();
    }, () => {
      const view = this.stage.chosen?.spaceView?.view;
      return view ? axesOf(view).back : null;
    });
    this.settings = new SettingsPanel((settings) => this.settingsChanged(settings),
      (cells) => this.cellSizeFor(cells));
    this.time = new TimePanel(() => this.track, () => {
      this.linkedFrame = null;
      for (const { numbers } of this.stage.panes) numbers.write();
      this.writeAddress();
    });
    this.curves = new CurvesPanel([...RESULT_CURVES, ...STREAM_CURVES], false, (sequence) => this.goTo(sequence));
    new Theme((dark) => {
      this.look.setDark(dark);
      this.curves.setDark(dark);
    });
    this.gaugesPanel = new GaugesPanel(this.gauges, (curves) => this.curves.setFirst(curves));
    this.exports = new ExportPanel(() => this.stage.chosen, () => this.look.look, this.gauges,
                    (text, isError, isGone) => this.status.report(text, isError, isGone));
    this.files = new FilesPanel({
      opened: (source, file) => this.openFile(source, file),
      asks: () => this.layout.ask(),
      report: (text, isError, isGone) => this.status.report(text, isError, isGone),
      optionsOf: (title) => this.linkedFile?.file === title ? parseOptions(this.linkedFile.open) : { ...NO_OPTIONS },
    });
    button('side-by-side').addEventListener('click', () => this.addBeside());
    input('linked').addEventListener('change', () => {
      this.stage.isLinked = this.link.isOn = input('linked').checked;
    });
    button('fit').addEventListener('click', () => this.fit());
    this.listenForKeys();
    this.streams = this.openStreams();
    this.readAddress();
    this.isReady = true;
    addEventListener('hashchange', () => {
      if (location.hash !== this.address) this.readAddress();
    });
    this.chosenChanged();
    requestAnimationFrame((now) => this.refresh(now));
  }

  private get track(): Track | null { return this.stage.chosen?.track ?? null; }

  private openStreams(): StreamsPanel {
    return new StreamsPanel(this.gateway, (id) => this.isOwn(id), {
      watch: (stream) => {
        this.watch(stream);
        this.layout.chosen();
      },
      beside: (stream) => {
        this.watchBeside(stream);
        this.layout.chosen();
      },
      first: (streams) => {
        const only = streams.length === 1 ? streams[0].streamName : null;
        if (only !== null && this.stage.panes.length === 0) this.watch(only);
      },
      failed: (text) => { this.status.server = text; },
      token: (token) => this.useToken(token),
    });
  }

  private isOwn(streamId: string): boolean {
    return this.stage.tracks.some((track) => track instanceof FileTrack && track.streamId === streamId) ||
      this.stage.panes.some(({ variantStream }) => variantStream?.streamId === streamId);
  }

  private useToken(token: string): void {
    this.gateway.token = token;
    sessionStorage.setItem(TOKEN_KEY, token);
    for (const track of this.stage.tracks) {
      if (track.state.kind !== 'failed') continue;
      if (track instanceof FileTrack) track.reopen(track.settings);
      else this.replaceTrack(track, new WatchTrack(this.gateway, track.title));
    }
  }

  private replaceTrack(old: Track, track: Track): void {
    for (const pane of this.stage.panes.filter((one) => one.track === old)) this.stage.replace(pane, track);
  }

  /** The track of a stream on the stage, or a new one. */
  private watchTrack(stream: string): Track {
    const present = this.stage.tracks.find((track) => track.kind === 'watch' && track.title === stream);
    return present ?? new WatchTrack(this.gateway, stream);
  }

  private watch(stream: string): void {
    const track = this.watchTrack(stream);
    if (track === this.track) track.player.follow();
    else this.show(track);
    this.writeAddress();
  }

  private watchBeside(stream: string): void {
    if (this.stage.isFull) this.reportFull();
    else this.stage.add(this.watchTrack(stream), { ...AS_STREAMED });
    this.writeAddress();
  }

  /** Shows a track in the chosen pane, or in a new first one. */
  private show(track: Track, settings: Settings = AS_STREAMED): void {
    const pane = this.stage.chosen;
    if (!pane) {
      this.stage.add(track, { ...settings });
    } else {
      pane.setSettings({ ...settings });
      this.stage.replace(pane, track);
    }
    this.chosenChanged();
    this.writeAddress();
  }

  /** Shows files. Files of the link get the panes of the link. Files on the stage are reopened with their new options. */
  private openFile(source: FrameSource, file: OpenFile): void {
    const address = this.linkedFile?.file === source.title ? this.linkedFile : null;
    const old = [...this.opened].find(([, { input }]) => input === file.input)?.[0];
    const settings = address?.panes[0].settings ?? old?.settings ?? file.settings ?? AS_STREAMED;
    const track = new FileTrack(this.gateway, source, { ...settings });
    this.opened.set(track, file);
    this.layout.chosen();
    if (address) {
      this.linkedFile = null;
      this.showPanes(address, track);
    } else if (old) {
      if (old.player.mode === 'paused') track.player.seek(old.player.sequence ?? 1);
      this.replaceTrack(old, track);
    } else {
      this.show(track, settings);
      if (file.sequence != null) track.player.seek(file.sequence);
    }
    this.writeAddress();
  }

  /** Offers the file of a closed track for reopening, unless another track has the same file. */
  private released(track: Track): void {
    const file = this.opened.get(track);
    this.opened.delete(track);
    if (!file || [...this.opened.values()].some(({ input }) => input === file.input)) return;
    const { mode, sequence } = track.player;
    this.files.addClosed({ ...file, settings: track.settings, sequence: mode === 'paused' ? sequence : null });
  }

  private reportFull(): void {
    this.status.report('The page shows at most four pictures. Close one of them.', true, () => !this.stage.isFull);
  }

  private addBeside(): void {
    const pane = this.stage.chosen;
    if (!pane) this.status.report(NO_PICTURE, true, () => this.stage.panes.length > 0);
    else if (this.stage.isFull) this.reportFull();
    else this.stage.add(pane.track, { ...pane.settings });
    this.writeAddress();
  }

  private settingsChanged(settings: Settings): void {
    const pane = this.stage.chosen;
    if (!pane) return;
    this.status.report('', false);
    // If the pane shows dropped files, only the first pane of these files reopens their stream with
    // the new settings. Each other pane has a temporary stream for its settings (VariantStream).
    const isFirst = this.stage.panes.find(({ track }) => track === pane.track) === pane;
    if (isFirst) pane.track.reopen?.(settings);
    pane.setSettings(settings);
    this.writeAddress();
  }

  /** The cell size for `cells` cells across the chosen picture; if it is empty, across another one of its track. */
  private cellSizeFor(cells: number): number | null {
    const { chosen } = this.stage;
    const siblings = this.stage.panes.filter(({ track }) => track === chosen?.track);
    return (chosen?.frame ? chosen : siblings.find(({ frame }) => frame))?.cellSizeFor(cells) ?? null;
  }

  private chosenChanged(): void {
    this.link.choose(this.track);
    const pane = this.stage.chosen;
    const number = pane ? this.stage.panes.indexOf(pane) + 1 : 0;
    const name = this.stage.panes.length > 1 ? `of picture ${number}` : '';
    this.settings.show(pane?.settings ?? AS_STREAMED, name);
    this.files?.show((pane && this.opened.get(pane.track)) ?? null);
    this.time.refresh();
    this.streams?.setShown(this.stage.tracks.filter(({ kind }) => kind === 'watch').map(({ title }) => title));
    this.writeAddress();
  }

  private lookChanged(): void {
    this.stage?.setLook(this.look.look);
    this.writeAddress();
  }

  private fit(): void {
    const { chosen } = this.stage;
    if (!chosen) return;
    chosen.fit();
    this.stage.linkViews(chosen, true);
  }

  private goTo(sequence: number): void {
    this.linkedFrame = null;
    this.track?.player.seek(sequence);
    this.writeAddress();
  }

  private listenForKeys(): void {
    const actions: Record<string, () => void> = {
      ' ': () => this.time.toggle(),
      ',': () => this.time.step(-1),
      '.': () => this.time.step(1),
      l: () => this.time.follow(),
      f: () => this.fit(),
    };
    releaseFocusAfterClicks();
    addEventListener('keydown', (event) => {
      const action = actions[event.key];
      if (!action || usesKey(event.target, event)) return;
      event.preventDefault();
      action();
    });
  }

  private readAddress(): void {
    this.address = location.hash;
    const address = parseAddress(this.address);
    this.look.text = address.look;
    if (address.space) this.space.text = address.space;
    this.linkedFile = address.file ? address : null;
    if (address.file) {
      this.status.report(`This link shows the file ${address.file}. Open it here.`, true, () => !this.linkedFile);
      return;
    }
    if (address.panes.length > 0) this.showPanes(address, null);
  }

  /** Shows the panes of a link. `file`: the track of panes without a stream. */
  private showPanes(address: Address, file: FileTrack | null): void {
    while (this.stage.panes.length > 0) this.stage.close(this.stage.panes[0]);
    for (const { stream, settings } of address.panes) {
      const track = file && !stream ? file : this.watchTrack(stream || address.panes[0].stream);
      const pane = this.stage.add(track, settings);
      if (address.view) pane.setView(address.view);
      if (address.camera) pane.setSpaceView(address.camera);
    }
    this.stage.choose(this.stage.panes[0]);
    if (file) {
      if (address.frame !== null) this.seekInFile(file, address.frame);
      return;
    }
    this.linkedFrame = address.frame;
    const track = this.stage.panes[0].track;
    if (address.frame !== null && track instanceof WatchTrack) track.request(address.frame);
  }

  private seekInFile(file: FileTrack, frame: number): void {
    const sequence = file.sequenceOf(frame);
    const { last } = file.range();
    if (sequence > last) {
      this.status.report(`The file has no frame ${frame} of the link. Its last frame is ${file.labelOf(last)}.`, true);
    }
    file.player.seek(sequence);
  }

  private writeAddress(): void {
    if (!this.isReady || this.linkedFrame !== null || this.linkedFile) return;
    if (location.hash !== this.address) return;  // The event of a new address has not arrived yet.
    const first = this.stage.panes[0];
    const file = first?.track.kind === 'file' ? first.track : null;
    // A link opens one file only.
    const panes = this.stage.panes.filter(({ track }) => track.kind === 'watch' || track === file);
    const player = first?.track.player;
    const leader = first && this.link.holds(first.track) ? this.track : first?.track;
    const isPaused = leader?.player.mode === 'paused';
    const camera = first?.spaceView;
    const address: Address = {
      panes: panes.map(({ track, settings }, k) => ({
        stream: track === file || (k > 0 && track === first.track) ? '' : track.title, settings,
      })),
      file: file?.title ?? '',
      open: optionsText((file && this.opened.get(file)?.options) ?? NO_OPTIONS),
      frame: isPaused && player && player.sequence !== null ? Number(first.track.labelOf(player.sequence)) : null,
      view: first && !camera && (!first.isFree || (first.frame && isPaused)) ? first.scene.view : null,
      camera: camera && (camera.isMoved || isPaused) ? camera.view : null,
      look: this.look.text,
      space: this.space.text,
    };
    const text = addressText(address);
    if (text === this.address) return;
    history.replaceState(null, '', text || location.pathname + location.search);
    this.address = location.hash;
  }

  /** Goes to the frame of the link once it has arrived. Until then a notice over the first picture says so. */
  private followLink(): void {
    const linked = this.linkedFrame;
    const [pane] = this.stage.panes;
    if (!pane) return;
    const { track } = pane;
    const last = track.range()?.last;
    pane.note = linked !== null && last !== undefined && linked > last
      ? `Waiting for frame ${linked} of the link. The newest frame is ${last}.` : '';
    if (linked === null) return;
    if (track.history.get(linked)) {
      track.player.seek(linked);
      this.linkedFrame = null;
    } else if (track instanceof WatchTrack && track.isGone(linked)) {
      this.status.report(`The server no longer holds frame ${linked}.`, true);
      this.linkedFrame = null;
    } else if (track.state.kind === 'ended' && last !== undefined && linked > last) {
      this.status.report(`The stream has ended with frame ${last}, before frame ${linked} of the link.`, true);
      this.linkedFrame = null;
    }
    if (this.linkedFrame === null) pane.note = '';
  }

  private refresh(now: number): void {
    this.pace.begin(now);
    const { tracks } = this.stage;
    const modes = tracks.map(({ player }) => player.mode);
    for (const track of tracks) {
      track.player.tick(now);
      track.refresh();
    }
    this.link.refresh(this.track, tracks);
    if (tracks.some(({ player }, k) => player.mode !== modes[k])) this.writeAddress();
    this.followLink();
    for (const pane of this.stage.panes) pane.refresh(this.pace);
    this.refreshPanels(now);
    requestAnimationFrame((next) => this.refresh(next));
  }

  private refreshPanels(now: number): void {
    byId('linked-label', HTMLElement).hidden = this.stage.panes.length < 2;
    const pane: Pane | null = this.stage.chosen;
    const isVariant = (pane?.variantStream ?? null) !== null;
    const isSpace = pane?.isSpace ?? false;
    this.look.setAttributes(pane?.channels ?? [], this.track);
    this.look.offer(pane?.frame ?? null, isVariant ? 'file' : this.track?.kind ?? 'watch', pane?.scene.isOnCanvas ?? true, isSpace);
    this.exports.offer(pane?.drawn.isOnCanvas ?? true, isSpace);
    this.space.offer(isSpace, (pane?.outlines.length ?? 0) > 1);
    this.settings.offer(pane?.hasSurfaces ?? false);
    this.gaugesPanel.offer(pane?.hasSurfaces ?? false);
    this.curves.setKind(pane?.hasSurfaces ? 'space' : 'plane');
    this.look.setOutlines(pane?.outlines ?? []);
    this.look.setLegend(pane?.legend ?? null);
    this.time.refresh(this.pace);
    const end = performance.now() + GAUGES_MS;
    this.gauges.measure(this.curves.shownEntries, () => performance.now() > end);
    this.curves.refresh(pane?.curves ?? null, isVariant ? this.track : null, pane?.summary ?? null,
      pane?.isStreamed ?? true, this.pace);
    this.status.refresh(this.stage.panes.map((one) => one.state), pane ? this.stage.panes.indexOf(pane) : 0,
      this.track, now);
  }
}
