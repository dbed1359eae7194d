import { theme } from '../colours';
import type { FrameTextures } from './frame_textures';
import type { Look } from '../look';
import { fillTones } from '../look_colours';
import { type AttributeStyle, type Camera, Programs } from './program';
import { BAND_TINT, EDGE_ALPHA, EDGE_TINT, EDGE_WIDTH, INTERIOR_TINT } from '../style';

const VERTEX = `
uniform sampler2D points;
uniform usampler2D triangles;
uniform usampler2D classes;
uniform usampler2D tints;
uniform sampler2D numbers;
uniform vec2 range;       // Smallest number, and 1 / (largest - smallest).
uniform vec4 ground, band, interior, edge;
uniform vec3 tintShares;  // Band, interior, edges.
flat out vec4 inside;
flat out vec4 edgeColour;
out vec3 heights;  // Distances to the three edges, device pixels.
out float value;

void main() {
  int triangle = gl_VertexID / 3;
  int corner = gl_VertexID - 3 * triangle;
  int vertex = int(texelFetch(triangles, at(gl_VertexID), 0).r);
  vec2 a = pixel(texelFetch(points, at(vertex), 0).rg);
  gl_Position = position(a);

  bool merged = texelFetch(classes, at(triangle), 0).r != 0u;
  inside = merged ? interior : band;
  edgeColour = edge;
  if (tinted) {
    vec4 tint = unpacked(texelFetch(tints, at(vertex), 0).r);
    inside = inside.a * mix(ground, tint, merged ? tintShares.y : tintShares.x);
    edgeColour.rgb = mix(ground, tint, tintShares.z).rgb;
  }

  value = byAttribute ? (texelFetch(numbers, at(vertex), 0).r - range.x) * range.y : 0.0;

  heights = vec3(0.0);
  if (!edged) return;
  int second = int(texelFetch(triangles, at(3 * triangle + (corner + 1) % 3), 0).r);
  int third = int(texelFetch(triangles, at(3 * triangle + (corner + 2) % 3), 0).r);
  vec2 b = pixel(texelFetch(points, at(second), 0).rg) - a;
  vec2 c = pixel(texelFetch(points, at(third), 0).rg) - a;
  float doubled = abs(b.x * c.y - b.y * c.x);
  float opposite = distance(b, c);
  heights[corner] = doubled / max(opposite, 1e-6);
  // Edges of tiny triangles would cover everything. They fade with the radius of the inscribed circle.
  edgeColour.a *= smoothstep(0.4, 3.0, doubled / max(opposite + length(b) + length(c), 1e-6));
}
`;

const FRAGMENT = `
uniform float halfWidth;  // Device pixels.
flat in vec4 inside;
flat in vec4 edgeColour;
in vec3 heights;
in float value;
out vec4 colour;

void main() {
  vec4 base = byAttribute ? attributeColour(value) : inside;
  colour = base;
  if (!edged) return;
  float near = min(heights.x, min(heights.y, heights.z));
  float cover = edgeColour.a * clamp(halfWidth + 0.5 - near, 0.0, 1.0);
  colour = mix(base, vec4(edgeColour.rgb, 1.0), cover);
}
`;

/**
 * The triangles of the mesh and their edges in one draw. Each of two triangles draws half of their
 * common edge, by the distance to it.
 */
export class FillPass {
  private readonly programs: Programs;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.programs = new Programs(gl, VERTEX, FRAGMENT);
  }

  draw(
    textures: FrameTextures, camera: Camera, look: Look, attribute: AttributeStyle | null,
    ratio: number,
  ): void {
    const style = textures.isMeshColoured ? attribute : null;
    const program = this.programs.for({
      byAttribute: style !== null, tinted: look.colour === 'identity', edged: look.edges,
    });
    const colours = theme(look.dark);
    const { band, interior } = fillTones(look);
    const opacity = look.fill ? 1 : 0;
    program.use(camera);
    program.texture('points', textures.outline.points);
    program.texture('triangles', textures.triangles);
    program.texture('classes', textures.classes);
    program.texture('tints', textures.tints);
    program.attribute(style, textures.attribute, textures.ramp);
    program.vector3('tintShares', [BAND_TINT, INTERIOR_TINT, EDGE_TINT]);
    program.colour('ground', colours.background);
    program.colour('band', look.fill ? band : [0, 0, 0], opacity);
    program.colour('interior', look.fill ? interior : [0, 0, 0], opacity);
    program.colour('edge', colours.edge, EDGE_ALPHA);
    program.number('halfWidth', (EDGE_WIDTH * ratio) / 2);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3 * textures.triangleCount);
  }

  destroy(): void {
    this.programs.destroy();
  }
}
