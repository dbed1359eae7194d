import { identityColour, mix, packed, theme } from '../draw/colours';
import { attributeOf, DEFAULT_LOOK, type Look } from '../draw/look';
import { chosenRange, type Range, rampTexels, widened } from '../draw/ramp';
import { type Legend, legendOf } from '../draw/scene';
import { Tracking } from '../draw/selection';
import type { Size } from '../draw/view';
import { bytesOf } from '../protocol/arrays';
import { AttributeChannels, type Channels } from '../protocol/channels';
import type { Frame } from '../protocol/frame';
import type { Outline } from '../protocol/sections';
import type { Surface } from '../protocol/surface';
import {
  axesOf, type Box, type Camera, cornersOf, DEFAULT_VIEW, distanceOf, dot, fitBox, minus, NEAREST, plus, rayAt, type SpaceView,
  unionOf, type Vector,
} from './camera';
import { type Clip, clipOf, type CutFace, cutFaceOf } from './clip';
import { SELECTED, type SpaceDrawing, type SpaceTheme, type ValueColours } from './drawing';
import { DEFAULT_SPACE_LOOK, type SpaceLook } from './look';
import { bodyOf, pickShell } from './pick';
import { checkSections, planeBorders, sectionLines } from './sections';
import { shellsByPlace } from './shells';

/** A frame with its decoded surface. */
export interface SpaceFrame { frame: Frame; surface: Surface; channels: Channels }

/** A shell under the pointer, and the point of it in world coordinates. */
export interface PickedShell { shell: number; point: Vector }

const MAP_COLOURS = 256;

/** A frame with a surface, ready to draw. Throws an Error with a sentence if its sections contradict themselves. */
export function spaceFrameOf(frame: Frame, surface: Surface): SpaceFrame {
  checkSections(frame.sections);
  const attributes = surface.attributes.map(({ name, components, values }) => ({ name, components, values: bytesOf(values) }));
  return { frame, surface, channels: new AttributeChannels(attributes) };
}

/** The box around all points of a surface; around the particles if there is no body. Null without both. */
export function boxOf({ boxes, particles, origin, positions }: Surface): Box | null {
  const low: [number, number, number] = [Infinity, Infinity, Infinity];
  const high: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  const points = positions.length > 0 ? boxes : particles ?? new Float32Array(0);
  for (let k = 0; k + 2 < points.length; k += 3) {
    for (let axis = 0; axis < 3; ++axis) {
      low[axis] = Math.min(low[axis], points[k + axis]);
      high[axis] = Math.max(high[axis], points[k + axis]);
    }
  }
  return low[0] <= high[0] ? { low: plus(origin, low), high: plus(origin, high) } : null;
}

function themeOf(dark: boolean): SpaceTheme {
  const { background, outline, edge, particle, accent, missing } = theme(dark);
  return { background, edge: dark ? mix(background, edge, 0.6) : outline, particle, accent, missing, ambient: dark ? 0.3 : 0.42 };
}

/** A canvas that shows one surface after another. Only `draw` draws. */
export class SpaceScene {
  view: SpaceView = { ...DEFAULT_VIEW };
  /** As of a plane scene: the canvas always has the picture. */
  readonly isOnCanvas = true;
  /** The canvas in CSS pixels at the last `resize`. Reading it from the page in each drawing would cost a layout. */
  size: Size = { width: 0, height: 0 };
  /** Called after each drawing, in the same task. */
  drawn: (() => void) | null = null;
  /** The box around all frames so far. */
  extent: Box | null = null;
  /** Main-thread time of the last `show` and the last `draw`, milliseconds. */
  lastUploadMs = 0;
  lastDrawMs = 0;
  private drawing: SpaceDrawing | null = null;
  private look: Look = DEFAULT_LOOK;
  private spaceLook: SpaceLook = DEFAULT_SPACE_LOOK;
  private shown: SpaceFrame | null = null;
  private outlines: readonly Outline[] = [];
  private range: Range | null = null;
  private texels: Uint8Array = new Uint8Array(0);
  private selected: readonly number[] = [];
  private readonly selection = new Tracking<SpaceFrame>(({ frame: { sequence }, surface: { identities, measures } }) =>
    ({ sequence, identities, parents: measures.parents }),
  (before, chosen, after) => shellsByPlace(before.surface, chosen, after.surface));

  constructor(readonly canvas: HTMLCanvasElement) {
    this.resize();
  }

  get frame(): SpaceFrame | null { return this.shown; }
  get camera(): Camera { return { view: this.view, isPerspective: this.spaceLook.isPerspective, size: this.size }; }
  /** Whether `draw` draws: space.js is loaded. */
  get isDrawing(): boolean { return this.drawing !== null; }
  get selectedShells(): readonly number[] { return this.selected; }

  attach(drawing: SpaceDrawing): void {
    this.drawing = drawing;
    this.upload();
  }

  show(shown: SpaceFrame | null, outlines: readonly Outline[]): void {
    const begin = performance.now();
    this.shown = shown;
    this.outlines = outlines;
    this.selected = shown ? this.selection.ringsOf(shown) : [];
    const box = shown && boxOf(shown.surface);
    if (box) this.extent = unionOf(this.extent, box);
    this.widenRange(false);
    this.upload();
    this.lastUploadMs = performance.now() - begin;
  }

  /** Shows nothing, and forgets the frames so far. */
  clear(): void {
    this.extent = null;
    this.range = null;
    this.show(null, []);
  }

  setLook(look: Look, spaceLook: SpaceLook): void {
    const isOtherColour = look.colour !== this.look.colour;
    const isOtherTheme = look.dark !== this.look.dark;
    const isOtherMap = look.map !== this.look.map || isOtherTheme || this.texels.length === 0;
    const hasOtherSections = look.sections !== this.look.sections || look.hidden !== this.look.hidden ||
      spaceLook.hasPlanes !== this.spaceLook.hasPlanes;
    this.look = { ...look };
    this.spaceLook = { ...spaceLook };
    if (isOtherMap) this.texels = rampTexels(MAP_COLOURS, look);
    if (isOtherColour) this.widenRange(true);
    if (isOtherColour || isOtherTheme) this.tint();
    if (isOtherTheme || hasOtherSections) this.showSections();
  }

  /** Fits the view to the frame shown, from the same direction. Forgets the boxes of earlier frames. */
  fit(): void {
    const box = this.shown && boxOf(this.shown.surface);
    if (this.shown) this.extent = box;
    if (box) this.view = fitBox(this.camera, box);
    this.showSections();
  }

  /** Fits the view to the box around all frames so far. */
  fitExtent(): void {
    if (this.extent) this.view = fitBox(this.camera, this.extent);
  }

  /** Adopts the size of the canvas on the page. */
  resize(): void {
    this.size = { width: this.canvas.clientWidth, height: this.canvas.clientHeight };
  }

  draw(): void {
    const begin = performance.now();
    const { look, spaceLook, shown, size, camera } = this;
    const [near, far] = this.depths();
    const { clip, cutFace } = this.cut();
    this.drawing?.draw({
      camera, look: spaceLook, theme: themeOf(look.dark), near, far,
      hasSurface: look.fill, hasEdges: look.edges, hasParticles: look.particles,
      spacing: shown?.frame.statistics.spacing ?? 0, lineWidth: look.lineWidth,
      clip, cutFace, values: this.values(),
      ratio: devicePixelRatio, origin: shown?.surface.origin ?? [0, 0, 0],
    });
    this.lastDrawMs = performance.now() - begin;
    if (size.width > 0) this.drawn?.();
  }

  /** Selects the shell of this identity and follows it through splits and merges; null for none. */
  select(identity: bigint | null): void {
    this.selection.start(identity);
    this.selected = this.shown ? this.selection.ringsOf(this.shown) : [];
    this.tint();
  }

  /** The nearest shell at a CSS position; null without one, or if the look does not draw the surface. */
  pick(x: number, y: number): PickedShell | null {
    if (!this.shown || !this.look.fill) return null;
    const { surface } = this.shown;
    const { from, along } = rayAt(this.camera, x, y);
    const { clip, cutFace } = this.cut();
    const hit = pickShell(surface, minus(from, surface.origin), along, !this.spaceLook.isPerspective, clip, cutFace !== null);
    return hit && { shell: hit.shell, point: plus(surface.origin, hit.point) };
  }

  legend(): Legend | null {
    return legendOf(this.look, this.colourRange, this.channels);
  }

  /** Names of the numbers that the frame can be coloured by. */
  get channels(): string[] {
    if (!this.shown) return [];
    return [...new Set([...this.shown.channels.keys(), ...this.shown.frame.particleAttributes?.keys() ?? []])];
  }

  destroy(): void {
    this.drawing?.destroy();
    this.drawing = null;
    this.shown = null;
  }

  private upload(): void {
    this.drawing?.show(this.shown?.surface ?? null);
    this.tint();
    this.showSections();
  }

  private showSections(): void {
    const { shown, outlines, look, extent, spaceLook: { hasPlanes } } = this;
    const lines = shown ? sectionLines(shown.frame, outlines, look, shown.surface.origin) : [];
    if (shown && extent && hasPlanes) lines.push(...planeBorders(outlines, look, extent, shown.surface.origin));
    this.drawing?.setSections(lines);
  }

  /** Writes the colour of each shell to its points. A cavity has the colour of its body, because a cut shows both. */
  private tint(): void {
    if (!this.shown || !this.drawing) return;
    const { pointOffsets, identities, outerOf, positions } = this.shown.surface;
    const { dark, colour } = this.look;
    const tints = new Uint32Array(positions.length / 3);
    const plain = packed(theme(dark).hole);
    const selected = new Set(this.selected);
    const halves = new Uint32Array(identities.buffer, identities.byteOffset, 2 * identities.length);
    for (let shell = 0; shell < outerOf.length; ++shell) {
      const body = bodyOf(this.shown.surface, shell);
      const rgba = colour === 'identity'
        ? packed(identityColour(halves[2 * body], halves[2 * body + 1], dark)) : plain;
      const alpha = (selected.has(shell) ? SELECTED.shell : 0) + (selected.has(body) ? SELECTED.body : 0);
      tints.fill(((rgba & 0xffffff) | alpha << 24) >>> 0, pointOffsets[shell], pointOffsets[shell + 1]);
    }
    this.drawing.setTints(new Uint8Array(tints.buffer));
  }

  private cut(): { clip: Clip | null; cutFace: CutFace | null } {
    const { extent, shown, spaceLook, camera } = this;
    if (!extent || !shown) return { clip: null, cutFace: null };
    const { origin } = shown.surface;
    const clip = clipOf(spaceLook, camera.view, extent, origin);
    return { clip, cutFace: cutFaceOf(clip, spaceLook, camera, extent, origin) };
  }

  private values(): ValueColours | null {
    const name = attributeOf(this.look);
    const range = this.colourRange;
    if (name === null || !this.shown || !range) return null;
    const { channels, surface: { positions, particles }, frame: { particleAttributes } } = this.shown;
    const forEach = (numbers: Float32Array | undefined, coordinates = 0) =>
      (numbers?.length === coordinates / 3 ? numbers : null);
    return {
      points: forEach(channels.get(name), positions.length),
      particles: forEach(particleAttributes?.get(name), particles?.length),
      ...range, texels: this.texels,
    };
  }

  private get colourRange(): Range | null {
    return this.range && chosenRange(this.range, this.look.from, this.look.to);
  }

  /** Adds the frame's numbers to the range, so that a colour keeps its meaning. `restart`: drops the range so far. */
  private widenRange(restart: boolean): void {
    if (restart) this.range = null;
    const name = attributeOf(this.look);
    if (name === null || !this.shown) return;
    for (const values of [this.shown.channels.get(name), this.shown.frame.particleAttributes?.get(name)]) {
      if (values) this.range = widened(this.range, values);
    }
  }

  /** The depths between which everything lies, seen from the camera. */
  private depths(): [number, number] {
    const distance = distanceOf(this.view);
    const box = this.extent;
    if (!box) return [NEAREST * distance, 2 * distance];
    const { back } = axesOf(this.view);
    const nearer = cornersOf(box).map((corner) => dot(minus(corner, this.view.target), back));
    // Sections may end outside of the box.
    const room = Math.hypot(...minus(box.high, box.low)) / 4;
    const near = distance - Math.max(...nearer) - room;
    const far = distance - Math.min(...nearer) + room;
    if (!this.spaceLook.isPerspective) return [near, far];
    const nearest = Math.max(near, NEAREST * distance);
    return [nearest, Math.max(far, 2 * nearest)];
  }
}
