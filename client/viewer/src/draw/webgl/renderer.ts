import type { Frame } from '../../protocol/frame';
import { theme, type Rgb } from '../colours';
import { FillPass } from './fill_pass';
import { FrameTextures } from './frame_textures';
import { LinePass, type LineStyle } from './line_pass';
import { type Look, shownIsolines } from '../look';
import { fillTones, isolineColour } from '../look_colours';
import { NormalPass } from './normal_pass';
import { ParticlePass } from './particle_pass';
import type { AttributeStyle, Camera } from './program';
import { RingFillPass } from './ring_fill_pass';
import type { Range } from '../ramp';
import { BAND_TINT, dotDiameter, ISOLINE_WIDTH } from '../style';
import type { View } from '../view';

/** Width of the halo on either side of a selected ring, in CSS pixels. */
const HALO = 4;
const HALO_ALPHA = 0.28;
/** Width of the border of a filled area without an outline, in CSS pixels. */
const BORDER = 1.25;

/** Content of one drawing. */
export interface Picture {
  frame: Frame | null;
  look: Look;
  view: View;
  /** Device pixels per CSS pixel. */
  ratio: number;
  /** Range of the attribute that the look colours by; null without an attribute, or if the frame lacks it. */
  range: Range | null;
  /** Rings to highlight. */
  selected: readonly number[];
  /** Ring under the pointer. */
  hovered: number | null;
}

/** Draws pictures on a canvas. */
export interface Drawing {
  /** Uploads the parts of the frame that the look draws. Throws a RangeError if the frame is too large. */
  prepare(frame: Frame, look: Look): void;
  draw(picture: Picture): void;
  destroy(): void;
}

/** Draws by WebGL2. Owns everything that is lost with the context. */
export class Renderer implements Drawing {
  private readonly textures: FrameTextures;
  private readonly fills: FillPass;
  private readonly ringFills: RingFillPass;
  private readonly lines: LinePass;
  private readonly normals: NormalPass;
  private readonly particles: ParticlePass;

  constructor(private readonly gl: WebGL2RenderingContext) {
    gl.bindVertexArray(gl.createVertexArray());
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.textures = new FrameTextures(gl);
    this.fills = new FillPass(gl);
    this.ringFills = new RingFillPass(gl);
    this.lines = new LinePass(gl);
    this.normals = new NormalPass(gl);
    this.particles = new ParticlePass(gl);
  }

  prepare(frame: Frame, look: Look): void {
    if (!this.gl.isContextLost()) this.textures.prepare(frame, look);
  }

  draw(picture: Picture): void {
    const { gl } = this;
    if (gl.isContextLost()) return;
    const { frame, look, view, ratio } = picture;
    const [red, green, blue] = theme(look.dark).background;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(red, green, blue, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (!frame) return;
    this.textures.prepare(frame, look);
    const camera: Camera = {
      centre: [view.x - frame.origin[0], view.y - frame.origin[1]],
      scale: view.scale * ratio,
      width: gl.drawingBufferWidth,
      height: gl.drawingBufferHeight,
    };
    const attribute = picture.range && { ...picture.range, missing: theme(look.dark).missing };
    if (frame.mesh && (look.fill || look.edges)) {
      this.fills.draw(this.textures, camera, look, attribute, ratio);
    } else if (look.fill) {
      this.ringFills.draw(this.textures.outline, camera, fillTones(look).band);
    }
    if (look.particles && frame.particles) {
      const diameter = ratio * dotDiameter(frame.statistics.spacing * view.scale);
      const own = frame.particleSizes ? { areDiscs: frame.particleSizes.areDiscs, ratio } : null;
      this.particles.draw(
        this.textures, camera, frame.particles.length / 2, { diameter, own }, look.dark, attribute);
    }
    if (look.normals && frame.rings.normals) this.drawNormals(picture, frame, camera);
    if (look.outline) this.drawOutline(picture, attribute, camera);
    else if (look.fill) this.smoothBorder(picture, attribute, camera);
    shownIsolines(frame, look).forEach(({ index, origin }, k) => {
      const centre: [number, number] = [view.x - origin[0], view.y - origin[1]];
      this.lines.draw(this.textures.isolines[k], this.textures, { ...camera, centre },
        solid(isolineColour(index, look.dark), 1, ISOLINE_WIDTH * ratio));
    });
    this.drawSelected(picture, frame, camera);
  }

  destroy(): void {
    this.textures.destroy();
    for (const pass of [
      this.fills, this.ringFills, this.lines, this.normals, this.particles,
    ]) {
      pass.destroy();
    }
  }

  private drawNormals(picture: Picture, frame: Frame, camera: Camera): void {
    const { look, view, ratio } = picture;
    const count = frame.rings.points.length / 2;
    this.normals.draw(this.textures, camera, count, frame.statistics.spacing * view.scale,
      (view.scale * frame.statistics.perimeter) / Math.max(count, 1), look.dark, ratio);
  }

  private drawOutline({ look, ratio }: Picture, attribute: AttributeStyle | null, camera: Camera): void {
    this.line(camera, { width: look.lineWidth * ratio, colour: null, opacity: 1, attribute });
  }

  /** Hides the jagged border of triangles under a thin line of their colour. */
  private smoothBorder({ look, ratio }: Picture, attribute: AttributeStyle | null, camera: Camera): void {
    const isTinted = look.colour === 'identity';
    const isColoured = attribute !== null && this.textures.isMeshColoured;
    this.line(camera, {
      width: BORDER * ratio,
      colour: isTinted || isColoured ? null : fillTones(look).band,
      opacity: isTinted ? BAND_TINT : 1,
      attribute: isColoured ? attribute : null,
    });
  }

  private drawSelected({ look, ratio, selected, hovered }: Picture, frame: Frame, camera: Camera): void {
    const { accent } = theme(look.dark);
    const width = Math.max(look.lineWidth, 1) + 0.5;
    const halo = solid(accent, HALO_ALPHA, ratio * (width + 2 * HALO));
    const line = solid(accent, 1, ratio * width);
    const { offsets } = frame.rings;
    const draw = (style: LineStyle, ring: number) =>
      this.line(camera, style, [offsets[ring], offsets[ring + 1]]);
    for (const ring of selected) draw(halo, ring);
    for (const ring of selected) draw(line, ring);
    if (hovered !== null && !selected.includes(hovered)) draw(line, hovered);
  }

  /** Draws the segments that begin at a range of vertices of the rings, or all segments. */
  private line(camera: Camera, style: LineStyle, range?: readonly [number, number]): void {
    this.lines.draw(this.textures.outline, this.textures, camera, style, range);
  }
}

function solid(colour: Rgb, opacity: number, width: number): LineStyle {
  return { width, colour, opacity, attribute: null };
}
