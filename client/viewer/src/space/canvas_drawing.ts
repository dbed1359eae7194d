// Draws surfaces on a canvas by the processor, for browsers without WebGL.
import { hex } from '../draw/colours';
import { dotDiameter, EDGE_ALPHA } from '../draw/style';
import type { Surface } from '../protocol/surface';
import {
  axesOf, type Camera, distanceOf, dot, minus, nearOf, plus, projectAll, unitsPerPixel, type Vector, vectorAt,
} from './camera';
import { heightsOf, nearOfClip } from './clip';
import {
  BORDER_WIDTH, HIDDEN_LINES, type SectionLines, SMALLEST_DOT, type SpaceDrawing, type SpaceState, TRANSLUCENT, TRANSLUCENT_EDGES,
} from './drawing';
import type { PointLights } from './facet';
import { Raster } from './raster';
import { LIGHT } from './shaders';

/** A picture that changes has one pixel for each CSS pixel. Once it is still for this time, it is drawn with more. */
const STILL_MS = 200;
const FINE_PIXELS = 2;
/** Lines are hidden or not in pieces of this length, in pixels, and in at most so many pieces. */
const LINE_PIECE = 8;
const MOST_PIECES = 500;
/** Lines in a surface are this much nearer, and cut faces farther, in CSS pixels. So they do not hide what lies in them. */
const LIFT = 3;

const unitOf = (v: Vector): Vector => {
  const length = Math.hypot(...v);
  return length > 0 ? [v[0] / length, v[1] / length, v[2] / length] : v;
};

/** The light on a surface, by the rules of SURFACE_FRAGMENT. */
class Lamp {
  private readonly light: Vector;
  private readonly back: Vector;
  private readonly eye: Vector | null;

  /** Places are relative to `origin`. */
  constructor({ view, isPerspective }: Camera, origin: Vector, private readonly ambient: number) {
    const { right, up, back } = axesOf(view);
    const [r, u, b] = LIGHT.direction;
    this.light = unitOf(plus(plus(plus([0, 0, 0], right, r), up, u), back, b));
    this.back = back;
    this.eye = isPerspective ? minus(plus(view.target, back, distanceOf(view)), origin) : null;
  }

  /** `diffuse`: share of the light, from 0 to 1. */
  lit(diffuse: number): number { return this.ambient + (LIGHT.brightest - this.ambient) * diffuse; }

  /** Light on a face whose normal has length 1. */
  lightOn(normal: Vector): number { return this.lit((0.5 * dot(normal, this.light) + 0.5) ** 2); }

  /** Highlight on a face. */
  shineOn(normal: Vector, place: Vector): number {
    const eye = this.eye ? unitOf(minus(this.eye, place)) : this.back;
    return LIGHT.shine * Math.max(dot(normal, unitOf(plus(this.light, eye))), 0) ** LIGHT.sharpness;
  }

  lightsOf({ positions, normals }: Surface): PointLights {
    const count = positions.length / 3;
    const lights = { outside: new Float32Array(count), inside: new Float32Array(count), shine: new Float32Array(count) };
    const size = normals.length / Math.max(1, count);
    for (let k = 0; k < count; ++k) {
      const normal = unitOf([normals[size * k], normals[size * k + 1], normals[size * k + 2]]);
      lights.outside[k] = this.lightOn(normal);
      lights.inside[k] = this.lightOn(minus([0, 0, 0], normal));
      lights.shine[k] = this.shineOn(normal, vectorAt(positions, k));
    }
    return lights;
  }
}

export class CanvasDrawing implements SpaceDrawing {
  private readonly context: CanvasRenderingContext2D;
  private readonly raster = new Raster();
  private surface: Surface | null = null;
  private tints: Uint8Array = new Uint8Array(0);
  private sections: readonly SectionLines[] = [];
  /** Describes the last drawing; empty if the content has changed since. */
  private drawn = '';
  private drawnValues: SpaceState['values'] = null;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** Throws an Error with a sentence if the browser cannot draw. */
  constructor(private readonly canvas: HTMLCanvasElement) {
    const context = canvas.getContext('2d', { alpha: false });
    if (!context) throw new Error('This browser cannot draw surfaces, because it has neither WebGL 2 nor canvases.');
    this.context = context;
  }

  show(surface: Surface | null): void {
    this.surface = surface;
    this.forget();
  }

  setTints(tints: Uint8Array): void {
    this.tints = tints;
    this.forget();
  }

  setSections(lines: readonly SectionLines[]): void {
    this.sections = lines;
    this.forget();
  }

  /** The next `draw` paints. No still picture of the former state follows. */
  private forget(): void {
    this.drawn = '';
    clearTimeout(this.timer);
  }

  /** Does nothing if the picture stays the same. */
  draw(state: SpaceState): void {
    const { values } = state;
    const text = JSON.stringify({ ...state, values: values && [values.min, values.max] });
    const isSame = text === this.drawn && (['points', 'particles', 'texels'] as const)
      .every((part) => values?.[part] === this.drawnValues?.[part]);
    if (isSame) return;
    this.drawn = text;
    this.drawnValues = values;
    this.paint(state, 1);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.paint(state, Math.max(FINE_PIXELS, state.ratio)), STILL_MS);
  }

  destroy(): void {
    clearTimeout(this.timer);
    this.show(null);
  }

  /** Draws with `scale` pixels for each CSS pixel. */
  private paint(state: SpaceState, scale: number): void {
    const { camera: { size }, look, theme, clip, cutFace, hasParticles, origin } = state;
    const [width, height] = [Math.round(size.width * scale), Math.round(size.height * scale)];
    if (width === 0 || height === 0) return;
    const camera = { ...state.camera, size: { width, height } };
    this.raster.begin(width, height, theme.background);
    // Translucent triangles do not hide particles, so the particles come first.
    if (hasParticles && look.isTranslucent) this.drawParticles(state, camera, scale);
    this.drawSurface(state, camera, scale);
    if (clip && cutFace) {
      const lowered = { ...clip, at: clip.at - LIFT * scale * unitsPerPixel(camera) };
      this.raster.closeCuts(nearOfClip(camera, lowered, origin));
    }
    if (hasParticles && !look.isTranslucent) this.drawParticles(state, camera, scale);
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    const bytes = new Uint8ClampedArray(this.raster.pixels.buffer);
    this.context.putImageData(new ImageData(bytes, width, height), 0, 0);
    for (const lines of this.sections) this.drawLines(lines, state, camera, scale);
  }

  private drawSurface(state: SpaceState, camera: Camera, scale: number): void {
    const { surface } = this;
    const { look, theme, clip, cutFace, values, hasSurface, hasEdges, origin } = state;
    if (!surface || !(hasSurface || hasEdges)) return;
    const { positions, triangles, inCut } = surface;
    const lamp = new Lamp(camera, origin, theme.ambient);
    const isFlat = (corner: number) => look.shading === 'flat' || inCut?.[corner] === 255;
    this.raster.drawTriangles({
      triangles, at: projectAll(camera, positions, origin), isPerspective: camera.isPerspective, tints: this.tints,
      values: values?.points ?? null, map: values, lights: lamp.lightsOf(surface),
      flatLight: (triangle, isInside) => {
        const corners = triangles.subarray(3 * triangle, 3 * triangle + 3);
        if (!corners.every(isFlat)) return null;
        const [a, b, c] = [0, 1, 2].map((k) => vectorAt(positions, corners[k]));
        const [u, v] = [minus(b, a), minus(c, a)];
        const outward = unitOf([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]);
        const normal = isInside ? minus([0, 0, 0], outward) : outward;
        return [lamp.lightOn(normal), lamp.shineOn(normal, a)];
      },
      heights: heightsOf(positions, clip), hasCutFace: cutFace !== null, cutFaceLight: lamp.lit(LIGHT.cutFace),
      opacity: look.isTranslucent ? TRANSLUCENT : 1, hasFill: hasSurface, halfEdge: hasEdges ? scale / 2 : 0,
      edgeOpacity: look.isTranslucent ? TRANSLUCENT_EDGES : EDGE_ALPHA, ...theme,
    });
  }

  private drawParticles(state: SpaceState, camera: Camera, scale: number): void {
    const positions = this.surface?.particles;
    if (!positions) return;
    const { theme, values, clip, spacing, origin } = state;
    const atTarget = scale * dotDiameter(spacing / unitsPerPixel(state.camera));
    const distance = distanceOf(camera.view);
    this.raster.drawDots({
      at: projectAll(camera, positions, origin),
      diameterOf: (near) => Math.max(atTarget * (camera.isPerspective ? distance * near : 1), scale * SMALLEST_DOT),
      values: values?.particles ?? null, map: values, heights: heightsOf(positions, clip),
      colour: theme.particle, missing: theme.missing,
    });
  }

  /** Draws lines, faint where something hides them. */
  private drawLines({ positions, colour, isBorder }: SectionLines, state: SpaceState, camera: Camera, scale: number): void {
    const { context, raster } = this;
    const { clip, lineWidth, origin } = state;
    const unit = unitsPerPixel(camera);
    const at = projectAll(camera, positions, origin);
    const heights = heightsOf(positions, clip && { ...clip, at: clip.at + lineWidth * scale * unit });
    const [all, visible] = [new Path2D(), new Path2D()];
    for (let k = 0; k + 1 < at.x.length; k += 2) {
      const length = Math.hypot(at.x[k + 1] - at.x[k], at.y[k + 1] - at.y[k]);
      const pieces = Math.min(Math.ceil(length / LINE_PIECE), MOST_PIECES);
      const along = (numbers: Float32Array, share: number) => numbers[k] + share * (numbers[k + 1] - numbers[k]);
      for (let piece = 0; piece < pieces; ++piece) {
        const middle = (piece + 0.5) / pieces;
        if (heights && along(heights, middle) > 0) continue;
        const near = liftedNear(camera, along(at.near, middle), LIFT * scale * unit);
        const isVisible = raster.shows(along(at.x, middle), along(at.y, middle), near);
        for (const path of isVisible ? [all, visible] : [all]) {
          path.moveTo(along(at.x, piece / pieces), along(at.y, piece / pieces));
          path.lineTo(along(at.x, (piece + 1) / pieces), along(at.y, (piece + 1) / pieces));
        }
      }
    }
    context.strokeStyle = hex(colour);
    context.lineCap = 'round';
    context.lineWidth = scale * (isBorder ? BORDER_WIDTH : lineWidth);
    for (const [path, alpha] of [[all, HIDDEN_LINES], [visible, 1]] as const) {
      context.globalAlpha = alpha;
      context.stroke(path);
    }
    context.globalAlpha = 1;
  }
}

/** `Projected.near` of a point that is moved towards the camera. */
function liftedNear(camera: Camera, near: number, lift: number): number {
  return nearOf(camera, (camera.isPerspective ? distanceOf(camera.view) - 1 / near : near) + lift);
}
