// Pixels of triangles and dots, for browsers without WebGL. Uses no other part of the browser.
import { packed, type Rgb } from '../draw/colours';
import type { Projected } from './camera';
import type { ValueColours } from './drawing';
import { colourIndex, Facet, pixelOf, type Skin } from './facet';

/** Dots and their look. */
export interface Dots {
  at: Projected;
  /** Diameter in pixels, by `Projected.near`. */
  diameterOf(near: number): number;
  /** A number of each dot, in place of the colour. */
  values: Float32Array | null;
  map: ValueColours | null;
  /** As of a skin. */
  heights: Float32Array | null;
  colour: Rgb;
  missing: Rgb;
}

/** Darkening of a dot's rim, as a share. */
const RIM = 0.35;

/** The pixels from one place to another whose middles lie between the places: the first and the last one. */
function pixelsBetween(low: number, high: number, count: number): [number, number] {
  return [Math.max(0, Math.ceil(low - 0.5)), Math.min(count - 1, Math.floor(high - 0.5))];
}

/** A picture of pixels with depths. */
export class Raster {
  width = 0;
  height = 0;
  /** By rows from the top; red in the lowest byte. */
  pixels = new Uint32Array(0);
  /** `Projected.near` of what is nearest. */
  near = new Float32Array(0);
  /** 1: a cut face is nearest. */
  private cuts = new Uint8Array(0);

  /** Begins a picture, which is empty. */
  begin(width: number, height: number, background: Rgb): void {
    [this.width, this.height] = [width, height];
    const count = width * height;
    if (this.pixels.length !== count) {
      this.pixels = new Uint32Array(count);
      this.near = new Float32Array(count);
      this.cuts = new Uint8Array(count);
    }
    this.pixels.fill(packed(background));
    this.near.fill(-Infinity);
    this.cuts.fill(0);
  }

  /** Draws triangles. Of translucent ones, all insides are drawn first; after that, the order is the one of the list. */
  drawTriangles(skin: Skin): void {
    const facet = new Facet(skin);
    for (const isInside of skin.opacity < 1 ? [true, false] : [null]) {
      for (let triangle = 0; triangle < skin.triangles.length / 3; ++triangle) {
        if (facet.choose(triangle) && (isInside ?? facet.isInside) === facet.isInside) this.drawFacet(facet, triangle);
      }
    }
  }

  /** Sets the depth of cut faces. `nearAt`: of the clip plane at a place. */
  closeCuts(nearAt: (x: number, y: number) => number): void {
    for (let y = 0, pixel = 0; y < this.height; ++y) {
      for (let x = 0; x < this.width; ++x, ++pixel) {
        if (this.cuts[pixel]) this.near[pixel] = nearAt(x + 0.5, y + 0.5);
      }
    }
  }

  drawDots(dots: Dots): void {
    const { at, heights, values, map } = dots;
    for (let k = 0; k < at.x.length; ++k) {
      if (Number.isNaN(at.near[k]) || (heights && heights[k] > 0)) continue;
      const index = values && map ? colourIndex(values[k], map) : -1;
      const plain = (values ? dots.missing : dots.colour).map((part) => 255 * part);
      const colour = map && index >= 0 ? map.texels.subarray(4 * index, 4 * index + 3) : plain;
      this.drawDot(at.x[k], at.y[k], at.near[k], dots.diameterOf(at.near[k]) / 2, colour);
    }
  }

  /** Whether a place is in the picture and nothing hides a point there. */
  shows(x: number, y: number, near: number): boolean {
    const [column, row] = [Math.floor(x), Math.floor(y)];
    return column >= 0 && row >= 0 && column < this.width && row < this.height && near >= this.near[row * this.width + column];
  }

  private drawFacet(facet: Facet, triangle: number): void {
    const { skin: { at, hasFill, opacity, halfEdge }, a, b, c, twice } = facet;
    const ax = at.x[a], ay = at.y[a];
    const bx = at.x[b] - ax, by = at.y[b] - ay, cx = at.x[c] - ax, cy = at.y[c] - ay;
    const [left, right] = pixelsBetween(ax + Math.min(0, bx, cx), ax + Math.max(0, bx, cx), this.width);
    const [top, bottom] = pixelsBetween(ay + Math.min(0, by, cy), ay + Math.max(0, by, cy), this.height);
    if (left > right || top > bottom || !facet.prepare(triangle)) return;
    const na = at.near[a], nb = at.near[b], nc = at.near[c];
    const { pixels, near, cuts } = this;
    const isOpaque = hasFill && opacity === 1;
    for (let y = top; y <= bottom; ++y) {
      const dy = y + 0.5 - ay;
      for (let x = left, pixel = y * this.width + left; x <= right; ++x, ++pixel) {
        const dx = x + 0.5 - ax;
        const wb = (dx * cy - dy * cx) / twice, wc = (bx * dy - by * dx) / twice, wa = 1 - wb - wc;
        if (wa < 0 || wb < 0 || wc < 0) continue;
        const depth = wa * na + wb * nb + wc * nc;
        if (!(depth > near[pixel]) || facet.isCutAway(wa, wb, wc)) continue;
        const isEdge = halfEdge > 0 && facet.isEdge(wa, wb, wc);
        if (!hasFill && !isEdge) continue;
        pixels[pixel] = facet.paint(wa, wb, wc, isEdge, pixels[pixel]);
        if (!isOpaque) continue;
        near[pixel] = depth;
        cuts[pixel] = facet.isCut ? 1 : 0;
      }
    }
  }

  private drawDot(x: number, y: number, near: number, radius: number, [red, green, blue]: ArrayLike<number> & Iterable<number>): void {
    const [left, right] = pixelsBetween(x - radius, x + radius, this.width);
    const [top, bottom] = pixelsBetween(y - radius, y + radius, this.height);
    for (let row = top; row <= bottom; ++row) {
      for (let column = left; column <= right; ++column) {
        const square = ((column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2) / radius ** 2;
        const pixel = row * this.width + column;
        if (square > 1 || !(near > this.near[pixel])) continue;
        this.near[pixel] = near;
        const light = 1 - RIM * square;
        this.pixels[pixel] = pixelOf(red * light, green * light, blue * light);
      }
    }
  }
}
