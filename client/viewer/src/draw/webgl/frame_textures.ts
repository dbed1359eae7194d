import type { Frame } from '../../protocol/frame';
import { DataTexture, TEXELS } from './data_texture';
import { attributeOf, type Look } from '../look';
import { pieceTints } from '../pieces';
import { rampTexels } from '../ramp';
import { ringColours } from '../look_colours';
import { RingTable } from './ring_table';

const RAMP_TEXELS = 256;

/** Colours of the attribute from its smallest to its largest number, for smooth look-ups. */
class RampTexture {
  private readonly texture: WebGLTexture;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.texture = gl.createTexture();
  }

  upload(dark: boolean): void {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, RAMP_TEXELS, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE,
      rampTexels(RAMP_TEXELS, dark));
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  }

  bind(unit: number): void {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.texture);
  }

  destroy(): void {
    this.gl.deleteTexture(this.texture);
  }
}

/**
 * A frame on the graphics card: what the look needs of it, and no more. Where the look comes to
 * need more, that part is uploaded then.
 */
export class FrameTextures {
  readonly points: DataTexture;
  readonly triangles: DataTexture;
  readonly classes: DataTexture;
  /** A colour per point of the mesh; filled where triangles are coloured by identity. */
  readonly tints: DataTexture;
  readonly ringOf: DataTexture;
  readonly rings: DataTexture;
  readonly normals: DataTexture;
  readonly attribute: DataTexture;
  readonly particles: DataTexture;
  readonly ramp: RampTexture;

  private frame: Frame | null = null;
  /** What is there of the frame: a part, and what it depends on beside the frame. */
  private readonly there = new Map<string, unknown>();
  private readonly table = new RingTable();
  private rampDark: boolean | null = null;

  constructor(gl: WebGL2RenderingContext) {
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.points = new DataTexture(gl, TEXELS.float2);
    this.triangles = new DataTexture(gl, TEXELS.uint32);
    this.classes = new DataTexture(gl, TEXELS.uint8);
    this.tints = new DataTexture(gl, TEXELS.uint32);
    this.ringOf = new DataTexture(gl, TEXELS.uint32);
    this.rings = new DataTexture(gl, TEXELS.uint32x4);
    this.normals = new DataTexture(gl, TEXELS.float2);
    this.attribute = new DataTexture(gl, TEXELS.float);
    this.particles = new DataTexture(gl, TEXELS.float2);
    this.ramp = new RampTexture(gl);
  }

  get triangleCount(): number {
    return this.frame?.mesh?.classes.length ?? 0;
  }

  /** Uploads what the look needs of the frame and is not there yet. */
  prepare(frame: Frame, look: Look): void {
    if (frame !== this.frame) {
      this.frame = frame;
      this.there.clear();
    }
    const { rings, mesh, particles } = frame;
    const meshed = mesh !== null && (look.fill || look.edges);
    // The first points of a mesh are those of the rings.
    if (meshed) this.once('points', 'mesh', () => this.points.upload(mesh.bytes.points));
    else if (!this.there.has('points')) {
      this.once('points', 'rings', () => this.points.upload(rings.points));
    }
    this.once('ringOf', true, () => this.ringOf.upload(this.table.ringOf(rings)));
    const colours = `${look.colour === 'identity'} ${look.dark}`;
    this.once('rings', colours, () => this.rings.upload(this.table.styles(rings, look)));
    if (meshed) {
      this.once('triangles', true, () => {
        this.triangles.upload(mesh.bytes.triangles);
        this.classes.upload(mesh.classes);
      });
      if (look.fill && look.colour === 'identity') {
        this.once('tints', colours, () => {
          this.tints.upload(pieceTints(mesh, rings, ringColours(rings, look)));
        });
      }
    }
    if (look.normals && rings.normals) {
      const { normals } = rings;
      this.once('normals', true, () => this.normals.upload(normals));
    }
    if (look.particles && particles) {
      this.once('particles', true, () => this.particles.upload(particles));
    }
    const name = attributeOf(look);
    const values = name === null ? undefined : rings.attributes.get(name);
    if (values) this.once('attribute', name, () => this.attribute.upload(values));
    if (this.rampDark !== look.dark) {
      this.rampDark = look.dark;
      this.ramp.upload(look.dark);
    }
  }

  destroy(): void {
    for (const texture of [
      this.points, this.triangles, this.classes, this.tints, this.ringOf, this.rings, this.normals,
      this.attribute, this.particles, this.ramp,
    ]) {
      texture.destroy();
    }
  }

  private once(part: string, dependsOn: unknown, upload: () => void): void {
    if (this.there.has(part) && this.there.get(part) === dependsOn) return;
    upload();
    this.there.set(part, dependsOn);
  }
}
