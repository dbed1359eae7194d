import type { Rgb } from '../colours';
import type { RingTextures } from './frame_textures';
import { type Camera, Programs } from './program';

const FAN_VERTEX = `
uniform sampler2D points;
uniform usampler2D ringOf;
uniform usampler2D rings;

void main() {
  int index = gl_VertexID / 3;
  int corner = gl_VertexID - 3 * index;
  uvec4 ring = texelFetch(rings, at(ringAt(texelFetch(ringOf, at(index), 0).r)), 0);
  int next = index + 1 == int(ring.y) ? int(ring.x) : index + 1;
  int point = corner == 0 ? int(ring.x) : corner == 1 ? index : next;
  gl_Position = position(pixel(texelFetch(points, at(point), 0).rg));
}
`;

const COVER_VERTEX = `
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
`;

const FRAGMENT = `
uniform vec4 tone;
out vec4 colour;
void main() { colour = tone; }
`;

/**
 * The inside of the rings of a frame without a mesh. A fan of triangles for each ring flips the
 * stencil, which is then set at pixels inside an odd number of rings. These pixels get the colour.
 */
export class RingFillPass {
  private readonly fans: Programs;
  private readonly cover: Programs;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.fans = new Programs(gl, FAN_VERTEX, FRAGMENT);
    this.cover = new Programs(gl, COVER_VERTEX, FRAGMENT);
  }

  draw(rings: RingTextures, camera: Camera, tone: Rgb): void {
    const { gl } = this;
    const fans = this.fans.for({});
    const cover = this.cover.for({});
    gl.enable(gl.STENCIL_TEST);
    gl.clear(gl.STENCIL_BUFFER_BIT);
    gl.colorMask(false, false, false, false);
    gl.stencilFunc(gl.ALWAYS, 0, 1);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INVERT);
    fans.use(camera);
    fans.texture('points', rings.points);
    fans.texture('ringOf', rings.ringOf);
    fans.texture('rings', rings.rings);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * rings.count);

    gl.colorMask(true, true, true, true);
    gl.stencilFunc(gl.EQUAL, 1, 1);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
    cover.use(camera);
    cover.colour('tone', tone);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.STENCIL_TEST);
  }

  destroy(): void {
    this.fans.destroy();
    this.cover.destroy();
  }
}
