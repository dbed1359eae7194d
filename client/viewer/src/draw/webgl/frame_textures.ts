import type { Frame, Rings } from '../../protocol/frame';
import { DataTexture, TEXELS } from './data_texture';
import { attributeOf, type Look, shownIsolines } from '../look';
import { pieceTints } from '../pieces';
import { rampTexels, type Ramp } from '../ramp';
import { ringColours } from '../look_colours';
import { RingTable } from './ring_table';

const RAMP_TEXELS = 256;

/** Colours of an attribute from its smallest to its largest number, filtered linearly. */
class RampTexture {
  private readonly texture: WebGLTexture;
  private shown = '';

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.texture = gl.createTexture();
  }

  upload({ dark, map }: Ramp): void {
    const shown = `${map} ${dark}`;
    if (this.shown === shown) return;
    this.shown = shown;
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, RAMP_TEXELS, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE,
      rampTexels(RAMP_TEXELS, { dark, map }));
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

/** Rings on the graphics card, for the passes that draw lines and fill rings. */
export class RingTextures {
  readonly points: DataTexture;
  readonly ringOf: DataTexture;
  readonly rings: DataTexture;
  readonly table = new RingTable();
  count = 0;

  constructor(gl: WebGL2RenderingContext) {
    this.points = new DataTexture(gl, TEXELS.float2);
    this.ringOf = new DataTexture(gl, TEXELS.uint32);
    this.rings = new DataTexture(gl, TEXELS.uint32x4);
  }

  /** Uploads everything but the points. */
  upload(rings: Rings): void {
    this.ringOf.upload(this.table.ringOf(rings));
    this.count = rings.points.length / 2;
  }

  destroy(): void {
    for (const texture of [this.points, this.ringOf, this.rings]) texture.destroy();
  }
}

/** A frame on the graphics card. Uploads only the parts that the look needs, once per frame. */
export class FrameTextures {
  readonly outline: RingTextures;
  /** One for each isoline drawn. The array never shrinks. */
  readonly isolines: RingTextures[] = [];
  readonly triangles: DataTexture;
  readonly classes: DataTexture;
  /** A colour per point of the mesh, filled if triangles are coloured by identity. */
  readonly tints: DataTexture;
  readonly normals: DataTexture;
  /** A number per vertex of the rings, or per point of the mesh if `isMeshColoured`. */
  readonly attribute: DataTexture;
  readonly particles: DataTexture;
  /** A diameter per particle, for frames with own sizes. */
  readonly particleSizes: DataTexture;
  /** A number per particle if `hasParticleColours`. */
  readonly particleNumbers: DataTexture;
  hasParticleColours = false;
  readonly ramp: RampTexture;
  isMeshColoured = false;
  /** Whether `attribute` has the numbers of the look's channel. */
  hasOutlineColours = false;

  private frame: Frame | null = null;
  /** Uploaded parts of the frame, with the part of the look that they depend on. */
  private readonly uploaded = new Map<string, unknown>();

  constructor(private readonly gl: WebGL2RenderingContext) {
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.outline = new RingTextures(gl);
    this.triangles = new DataTexture(gl, TEXELS.uint32);
    this.classes = new DataTexture(gl, TEXELS.uint8);
    this.tints = new DataTexture(gl, TEXELS.uint32);
    this.normals = new DataTexture(gl, TEXELS.float2);
    this.attribute = new DataTexture(gl, TEXELS.float);
    this.particles = new DataTexture(gl, TEXELS.float2);
    this.particleSizes = new DataTexture(gl, TEXELS.float);
    this.particleNumbers = new DataTexture(gl, TEXELS.float);
    this.ramp = new RampTexture(gl);
  }

  get triangleCount(): number {
    return this.frame?.mesh?.classes.length ?? 0;
  }

  prepare(frame: Frame, look: Look): void {
    if (frame !== this.frame) {
      this.frame = frame;
      this.uploaded.clear();
    }
    const colours = `${look.colour === 'identity'} ${look.dark}`;
    const isMeshed = frame.mesh !== null && (look.fill || look.edges);
    this.prepareRings(frame, look, colours, isMeshed);
    if (isMeshed) this.prepareMesh(frame, look, colours);
    this.prepareAttribute(frame, look);
    const { rings, particles, particleSizes } = frame;
    shownIsolines(frame, look).forEach((isoline, k) => {
      this.isolines[k] ??= new RingTextures(this.gl);
      this.once(`isolines ${k}`, isoline.index, () => {
        this.isolines[k].points.upload(isoline.rings.points);
        this.isolines[k].upload(isoline.rings);
        this.isolines[k].rings.upload(this.isolines[k].table.styles(isoline.rings, look));
      });
    });
    if (look.normals && rings.normals) {
      const { normals } = rings;
      this.once('normals', true, () => this.normals.upload(normals));
    }
    if (look.particles && particles) {
      this.once('particles', true, () => this.particles.upload(particles));
      if (particleSizes) this.once('particleSizes', true, () => this.particleSizes.upload(particleSizes.diameters));
      this.prepareParticleNumbers(frame, look);
    }
    this.ramp.upload(look);
  }

  destroy(): void {
    for (const texture of [
      this.outline, ...this.isolines, this.triangles, this.classes, this.tints, this.normals,
      this.attribute, this.particles, this.particleSizes, this.particleNumbers, this.ramp,
    ]) {
      texture.destroy();
    }
  }

  private prepareRings(frame: Frame, look: Look, colours: string, isMeshed: boolean): void {
    const { rings, mesh } = frame;
    const { outline } = this;
    if (isMeshed && mesh) {
      this.once('points', 'mesh', () => outline.points.upload(mesh.bytes.points));
    } else if (!this.uploaded.has('points')) {
      this.once('points', 'rings', () => outline.points.upload(rings.points));
    }
    this.once('ringOf', true, () => outline.upload(rings));
    this.once('rings', colours, () => outline.rings.upload(outline.table.styles(rings, look)));
  }

  private prepareMesh({ rings, mesh }: Frame, look: Look, colours: string): void {
    if (!mesh) return;
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

  private prepareAttribute({ rings, mesh }: Frame, look: Look): void {
    const name = attributeOf(look);
    this.once('attribute', `${name} ${look.fill}`, () => {
      const ofMesh = name !== null && look.fill ? mesh?.attribute(name) : undefined;
      const values = ofMesh ?? (name === null ? undefined : rings.attributes.get(name));
      this.isMeshColoured = ofMesh !== undefined;
      this.hasOutlineColours = values !== undefined;
      if (values) this.attribute.upload(values);
    });
  }

  private prepareParticleNumbers({ particleAttributes }: Frame, look: Look): void {
    const name = attributeOf(look);
    this.once('particleNumbers', name, () => {
      const values = name === null ? undefined : particleAttributes?.get(name);
      this.hasParticleColours = values !== undefined;
      if (values) this.particleNumbers.upload(values);
    });
  }

  private once(part: string, dependsOn: unknown, upload: () => void): void {
    if (this.uploaded.has(part) && this.uploaded.get(part) === dependsOn) return;
    upload();
    this.uploaded.set(part, dependsOn);
  }
}
