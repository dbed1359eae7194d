// Colours of triangles for raster.ts, by the rules of SURFACE_FRAGMENT.
import type { Rgb } from '../draw/colours';
import type { Projected } from './camera';
import { SELECTED, type ValueColours } from './drawing';
import { ACCENT_SHARE, LIGHT } from './shaders';

/** Light at each point, seen from outside and from inside; and the highlight, which the inside lacks. */
export interface PointLights { outside: Float32Array; inside: Float32Array; shine: Float32Array }

/** Triangles and their look. */
export interface Skin {
  triangles: Uint32Array;
  at: Projected;
  isPerspective: boolean;
  /** As of SpaceDrawing.setTints. */
  tints: Uint8Array;
  /** A number of each point, in place of the tints. */
  values: Float32Array | null;
  map: ValueColours | null;
  lights: PointLights;
  /** Light and highlight of a flat triangle; null for one that has the lights of its points. */
  flatLight(triangle: number, isInside: boolean): readonly [number, number] | null;
  /** Height of each point above the clip plane, which cuts away what is above it. */
  heights: Float32Array | null;
  hasCutFace: boolean;
  cutFaceLight: number;
  /** Below 1, triangles hide nothing. */
  opacity: number;
  /** Without a fill, triangles have only edges. */
  hasFill: boolean;
  /** Half the width of edges in pixels. 0: no edges. */
  halfEdge: number;
  edgeOpacity: number;
  edge: Rgb;
  accent: Rgb;
  missing: Rgb;
}

/** Index of a number's colour in the map; -1 for a missing number. */
export function colourIndex(value: number, { min, max, texels }: ValueColours): number {
  if (!Number.isFinite(value)) return -1;
  const share = max > min ? Math.min(Math.max((value - min) / (max - min), 0), 1) : 0;
  return Math.floor(share * (texels.length / 4 - 1) + 0.5);
}

/** A pixel: red in the lowest byte, opaque. The parts are from 0 to 255; larger ones are cut off. */
export function pixelOf(red: number, green: number, blue: number): number {
  const byte = (part: number) => Math.min(part, 255) + 0.5 | 0;
  return (255 << 24 | byte(blue) << 16 | byte(green) << 8 | byte(red)) >>> 0;
}

const bytes = (colour: Rgb): Rgb => [255 * colour[0], 255 * colour[1], 255 * colour[2]];

/** One triangle of a skin at a time. Its corners are a, b, c. */
export class Facet {
  a = 0;
  b = 0;
  c = 0;
  isInside = false;
  /** Whether it shows a cut face. */
  isCut = false;
  /** The cross product of the sides in the picture. */
  twice = 0;
  private readonly accent: Rgb;
  private readonly edge: Rgb;
  private readonly missing: Rgb;
  private accentShare = 0;
  private dimming = 1;
  /** Weights of the corners in space, by which their shares in the picture are multiplied. */
  private qa = 1;
  private qb = 1;
  private qc = 1;
  /** Light and highlight at the corners. */
  private la = 0;
  private lb = 0;
  private lc = 0;
  private sa = 0;
  private sb = 0;
  private sc = 0;
  /** Distance of each corner from the side opposite to it, in pixels. */
  private ea = 0;
  private eb = 0;
  private ec = 0;

  constructor(readonly skin: Skin) {
    this.accent = bytes(skin.accent);
    this.edge = bytes(skin.edge);
    this.missing = bytes(skin.missing);
  }

  /** Takes a triangle. Returns false for one that the camera cannot see. */
  choose(triangle: number): boolean {
    const { triangles, at: { x, y, near } } = this.skin;
    const [a, b, c] = [triangles[3 * triangle], triangles[3 * triangle + 1], triangles[3 * triangle + 2]];
    this.twice = (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]);
    // `near` is NaN behind the camera.
    if (this.twice === 0 || !Number.isFinite(this.twice + near[a] + near[b] + near[c])) return false;
    [this.a, this.b, this.c] = [a, b, c];
    // Rows count downwards, so triangles turn clockwise in the picture if they are seen from outside.
    this.isInside = this.twice > 0;
    this.isCut = this.skin.hasCutFace && this.isInside;
    return true;
  }

  /** Prepares `heightAt` and `paint`. Returns false if the clip plane cuts the whole triangle away. */
  prepare(triangle: number): boolean {
    const { skin, a, b, c, isInside, isCut } = this;
    const { at: { x, y, near }, heights, lights, tints } = skin;
    if (heights && heights[a] > 0 && heights[b] > 0 && heights[c] > 0) return false;
    if (skin.isPerspective) [this.qa, this.qb, this.qc] = [near[a], near[b], near[c]];
    const flat = isCut ? null : skin.flatLight(triangle, isInside);
    const light = isInside ? lights.inside : lights.outside;
    if (isCut) this.la = this.lb = this.lc = skin.cutFaceLight;
    else if (flat) this.la = this.lb = this.lc = flat[0];
    else [this.la, this.lb, this.lc] = [light[a], light[b], light[c]];
    if (isInside) this.sa = this.sb = this.sc = 0;
    else if (flat) this.sa = this.sb = this.sc = flat[1];
    else [this.sa, this.sb, this.sc] = [lights.shine[a], lights.shine[b], lights.shine[c]];
    const alpha = tints[4 * a + 3];
    const isSelected = isCut ? alpha % SELECTED.shell >= SELECTED.body : alpha >= SELECTED.shell;
    this.accentShare = isSelected ? ACCENT_SHARE : 0;
    this.dimming = isInside && !isCut ? LIGHT.inside : 1;
    if (skin.halfEdge > 0) {
      const size = Math.abs(this.twice);
      this.ea = size / Math.hypot(x[c] - x[b], y[c] - y[b]);
      this.eb = size / Math.hypot(x[c] - x[a], y[c] - y[a]);
      this.ec = size / Math.hypot(x[b] - x[a], y[b] - y[a]);
    }
    return true;
  }

  /** Whether the clip plane cuts a point away. The shares of the corners in the picture determine the point. */
  isCutAway(wa: number, wb: number, wc: number): boolean {
    const { skin: { heights }, a, b, c } = this;
    return heights !== null && wa * this.qa * heights[a] + wb * this.qb * heights[b] + wc * this.qc * heights[c] > 0;
  }

  /** Whether a point belongs to an edge. */
  isEdge(wa: number, wb: number, wc: number): boolean {
    return !this.isCut && Math.min(wa * this.ea, wb * this.eb, wc * this.ec) < this.skin.halfEdge;
  }

  /** The pixel of a point, over the pixel `under`. */
  paint(wa: number, wb: number, wc: number, isEdge: boolean, under: number): number {
    const { skin, accent, accentShare, edge } = this;
    const [tr, tg, tb] = this.baseAt(wa, wb, wc);
    const light = wa * this.la + wb * this.lb + wc * this.lc;
    const shine = 255 * (wa * this.sa + wb * this.sb + wc * this.sc);
    const opacity = skin.hasFill ? skin.opacity : 0;
    const edgeOpacity = isEdge ? skin.edgeOpacity : 0;
    const part = (base: number, ofAccent: number, ofEdge: number, below: number) => {
      const lit = Math.min(255, (base + (ofAccent - base) * accentShare) * this.dimming * light + shine);
      const filled = lit * opacity + below * (1 - opacity);
      return filled + (ofEdge - filled) * edgeOpacity;
    };
    return pixelOf(part(tr, accent[0], edge[0], under & 255), part(tg, accent[1], edge[1], under >> 8 & 255),
      part(tb, accent[2], edge[2], under >> 16 & 255));
  }

  /** The colour of a point without light, each part from 0 to 255. */
  private baseAt(wa: number, wb: number, wc: number): Rgb {
    const { skin: { values, map, tints }, a, b, c } = this;
    if (!values || !map) return [tints[4 * a], tints[4 * a + 1], tints[4 * a + 2]];
    if (this.isCut) return this.missing;
    const [pa, pb, pc] = [wa * this.qa, wb * this.qb, wc * this.qc];
    const index = 4 * colourIndex((pa * values[a] + pb * values[b] + pc * values[c]) / (pa + pb + pc), map);
    return index < 0 ? this.missing : [map.texels[index], map.texels[index + 1], map.texels[index + 2]];
  }
}
