import { theme } from '../colours';
import type { FrameTextures } from './frame_textures';
import { type Camera, Programs } from './program';
import { NORMAL_WIDTH, normalLength, normalStride } from '../style';

const VERTEX = `
uniform sampler2D points;
uniform sampler2D normals;
uniform int stride;
uniform float reach;      // Length of a normal, device pixels.
uniform float halfWidth;  // Device pixels.
flat out vec2 along;
out vec2 offset;

void main() {
  int index = gl_VertexID / 6;
  int corner = gl_VertexID - 6 * index;
  vec2 normal = texelFetch(normals, at(index * stride), 0).rg;
  along = normal * reach;
  int which = corner < 3 ? corner : corner == 3 ? 2 : corner == 4 ? 1 : 3;
  float margin = halfWidth + 1.0;
  vec2 side = vec2(-normal.y, normal.x) * ((which & 1) == 1 ? -margin : margin);
  offset = (which >= 2 ? along + normal * margin : -normal * margin) + side;
  gl_Position = position(pixel(texelFetch(points, at(index * stride), 0).rg) + offset);
}
`;

const FRAGMENT = `
uniform vec4 line;
uniform float halfWidth;
flat in vec2 along;
in vec2 offset;
out vec4 colour;

void main() {
  float share = clamp(dot(offset, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
  // The line tapers towards the end, which shows the direction.
  float inner = halfWidth * (1.0 - 0.6 * share);
  float cover = clamp(inner + 0.5 - distance(offset, along * share), 0.0, 1.0);
  colour = vec4(line.rgb * cover, cover);
}
`;

/** Normals as short lines from the vertices; every n-th if vertices are dense. */
export class NormalPass {
  private readonly programs: Programs;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.programs = new Programs(gl, VERTEX, FRAGMENT);
  }

  /** Draws normals of `count` vertices, or every n-th. `spacing` of particles and `gap` of vertices: in CSS pixels. */
  draw(
    textures: FrameTextures, camera: Camera, count: number, spacing: number, gap: number,
    dark: boolean, ratio: number,
  ): void {
    const program = this.programs.for({});
    const stride = normalStride(gap, count);
    program.use(camera);
    program.texture('points', textures.outline.points);
    program.texture('normals', textures.normals);
    program.integer('stride', stride);
    program.number('reach', ratio * normalLength(spacing));
    program.number('halfWidth', (ratio * NORMAL_WIDTH) / 2);
    program.colour('line', theme(dark).normal);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 6 * Math.ceil(count / stride));
  }

  destroy(): void {
    this.programs.destroy();
  }
}
