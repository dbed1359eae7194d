import type { Frame } from '../../protocol/frame';
import { theme, type Rgb } from '../colours';
import { FillPass } from './fill_pass';
import { FrameTextures } from './frame_textures';
import { LinePass, type LineStyle } from './line_pass';
import type { Look } from '../look';
import { fillTones } from '../look_colours';
import { NormalPass } from './normal_pass';
import { ParticlePass } from './particle_pass';
import type { Camera } from './program';
import { RingFillPass } from './ring_fill_pass';
import type { Range } from '../ramp';
import { BAND_TINT, dotDiameter } from '../style';
import type { View } from '../view';

/** Around the line of a selected ring, in CSS pixels on either side. */
const HALO = 4;
const HALO_ALPHA = 0.28;
/** Around what is filled and has no outline, in CSS pixels. */
const BORDER = 1.25;

/** What one picture shows. */
export interface Picture {
  frame: Frame | null;
  look: Look;
  view: View;
  /** Device pixels per CSS pixel. */
  ratio: number;
  /** Of the attribute that the look colours by; null where the frame has none of that name. */
  range: Range | null;
  /** Rings that stand out. */
  selected: readonly number[];
}

/** All that lives on the graphics card, hence all that is lost with a context. */
export class Renderer {
  readonly textures: FrameTextures;
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

  draw(picture: Picture): void {
    const { gl } = this;
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
    if (frame.mesh && (look.fill || look.edges)) {
      this.fills.draw(this.textures, camera, look, ratio);
    } else if (look.fill) {
      const count = frame.rings.points.length / 2;
      this.ringFills.draw(this.textures, camera, count, fillTones(look).band);
    }
    if (look.particles && frame.particles) {
      const diameter = ratio * dotDiameter(frame.statistics.spacing * view.scale);
      this.particles.draw(
        this.textures, camera, frame.particles.length / 2, diameter, look.dark);
    }
    if (look.normals && frame.rings.normals) this.drawNormals(picture, frame, camera);
    if (look.outline) this.drawOutline(picture, frame, camera);
    else if (look.fill) this.smoothBorder(picture, frame, camera);
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

  private drawOutline(picture: Picture, frame: Frame, camera: Camera): void {
    const { look, range } = picture;
    const attribute = range && { ...range, missing: theme(look.dark).missing };
    this.line(frame, camera, {
      width: look.lineWidth * picture.ratio, colour: null, opacity: 1, attribute,
    });
  }

  /** Triangles end in steps, which a thin line in their colour hides. */
  private smoothBorder(picture: Picture, frame: Frame, camera: Camera): void {
    const { look, ratio } = picture;
    const tinted = look.colour === 'identity';
    this.line(frame, camera, {
      width: BORDER * ratio,
      colour: tinted ? null : fillTones(look).band,
      opacity: tinted ? BAND_TINT : 1,
      attribute: null,
    });
  }

  private drawSelected(picture: Picture, frame: Frame, camera: Camera): void {
    const { look, ratio } = picture;
    const { accent } = theme(look.dark);
    const width = Math.max(look.lineWidth, 1) + 0.5;
    const styles = [
      solid(accent, HALO_ALPHA, ratio * (width + 2 * HALO)),
      solid(accent, 1, ratio * width),
    ];
    for (const style of styles) {
      for (const ring of picture.selected) this.line(frame, camera, style, ring);
    }
  }

  /** One ring, or all. */
  private line(frame: Frame, camera: Camera, style: LineStyle, ring?: number): void {
    const { offsets } = frame.rings;
    const first = ring === undefined ? 0 : offsets[ring];
    const end = ring === undefined ? frame.rings.points.length / 2 : offsets[ring + 1];
    this.lines.draw(this.textures, camera, style, first, end);
  }
}

function solid(colour: Rgb, opacity: number, width: number): LineStyle {
  return { width, colour, opacity, attribute: null };
}
