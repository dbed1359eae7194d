import type { Rgb } from '../colours';
import type { FrameTextures } from './frame_textures';
import { type Camera, Program } from './program';

const VERTEX = `
uniform sampler2D points;
uniform usampler2D ringOf;
uniform usampler2D rings;     // First point, point after the last, colour, unused.
uniform sampler2D numbers;
uniform bool byAttribute;
uniform vec2 range;           // Smallest attribute, and 1 / (largest - smallest).
uniform vec4 single;          // The colour of all, where its alpha is 1.
uniform float halfWidth;      // Device pixels.
flat out vec2 along;          // From the first to the second end of the segment.
flat out vec2 firstSplit;     // Tangents of the outline at both ends.
flat out vec2 secondSplit;
flat out vec4 ringColour;
flat out vec2 values;         // Of the attribute at both ends, 0 to 1.
flat out vec2 begin;          // The first end, from the canvas's lower left corner.

// The direction of the line that halves the corner; its own where the outline turns back.
vec2 tangent(vec2 before, vec2 after, vec2 own) {
  vec2 sum = before + after;
  return dot(sum, sum) > 1e-4 ? sum : own;
}

vec2 direction(vec2 vector, vec2 otherwise) {
  float length2 = dot(vector, vector);
  return length2 > 1e-12 ? vector * inversesqrt(length2) : otherwise;
}

void main() {
  int index = gl_VertexID / 6;
  int corner = gl_VertexID - 6 * index;
  uvec4 ring = texelFetch(rings, at(int(texelFetch(ringOf, at(index), 0).r)), 0);
  int first = int(ring.x);
  int last = int(ring.y) - 1;
  int next = index == last ? first : index + 1;
  vec2 a = pixel(texelFetch(points, at(index), 0).rg);
  vec2 b = pixel(texelFetch(points, at(next), 0).rg);
  vec2 before = pixel(texelFetch(points, at(index == first ? last : index - 1), 0).rg);
  vec2 after = pixel(texelFetch(points, at(next == last ? first : next + 1), 0).rg);

  along = b - a;
  vec2 own = direction(along, vec2(1.0, 0.0));
  firstSplit = tangent(direction(a - before, own), own, own);
  secondSplit = tangent(own, direction(after - b, own), own);
  // Two triangles: 0 1 2, 2 1 3; odd corners lie to the right, those from 2 on at the second end.
  int which = corner < 3 ? corner : corner == 3 ? 2 : corner == 4 ? 1 : 3;
  bool second = which >= 2;
  float reach = halfWidth + 1.0;
  vec2 side = vec2(-own.y, own.x) * ((which & 1) == 1 ? -reach : reach);
  begin = a + 0.5 * size;
  gl_Position = position((second ? b : a) + own * (second ? reach : -reach) + side);

  ringColour = single.a > 0.0 ? single : unpacked(ring.z);
  values = vec2(0.0);
  if (byAttribute) {
    values = vec2(texelFetch(numbers, at(index), 0).r, texelFetch(numbers, at(next), 0).r);
    values = (values - range.x) * range.y;
  }
}
`;

const FRAGMENT = `
uniform bool byAttribute;
uniform sampler2D ramp;
uniform vec4 missing;
uniform float halfWidth;
uniform float opacity;
flat in vec2 along;
flat in vec2 firstSplit;
flat in vec2 secondSplit;
flat in vec4 ringColour;
flat in vec2 values;
flat in vec2 begin;
out vec4 colour;

void main() {
  // Not interpolated: corners of triangles are rounded to parts of a pixel before they are filled.
  vec2 place = gl_FragCoord.xy - begin;  // From the first end.
  // Each pixel near a corner belongs to one of its two segments, so that none is covered twice.
  if (dot(place, firstSplit) < 0.0 || dot(place - along, secondSplit) >= 0.0) discard;
  float share = clamp(dot(place, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
  float away = distance(place, along * share);
  // A line thinner than a pixel is a pixel wide and lighter.
  float cover = clamp(max(halfWidth, 0.5) + 0.5 - away, 0.0, 1.0) * min(2.0 * halfWidth, 1.0);
  vec4 base = ringColour;
  if (byAttribute) {
    float value = mix(values.x, values.y, share);
    bool known = value == value && abs(value) < 1e30;
    base = known ? texture(ramp, vec2(value * (255.0 / 256.0) + 0.5 / 256.0, 0.5)) : missing;
  }
  float alpha = opacity * cover;
  colour = vec4(base.rgb * alpha, alpha);
}
`;

/** How the outline, or a part of it, is drawn. */
export interface LineStyle {
  /** Device pixels. */
  width: number;
  /** One colour for all; null: each ring its own, or by the attribute. */
  colour: Rgb | null;
  opacity: number;
  attribute: { min: number; max: number; missing: Rgb } | null;
}

/**
 * The rings as lines with round joins. Coverage comes from the distance to the segment, thus lines
 * are smooth without multisampling, at any width and on any screen.
 */
export class LinePass {
  private readonly program: Program;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.program = new Program(gl, VERTEX, FRAGMENT);
  }

  /** Draws the segments that begin at the points [first, end) of the rings. */
  draw(
    textures: FrameTextures, camera: Camera, style: LineStyle, first: number, end: number,
  ): void {
    const { program } = this;
    program.use(camera);
    program.texture('points', textures.points);
    program.texture('ringOf', textures.ringOf);
    program.texture('rings', textures.rings);
    program.texture('numbers', textures.attribute);
    program.texture('ramp', textures.ramp);
    program.colour('single', style.colour ?? [0, 0, 0], style.colour ? 1 : 0);
    program.number('opacity', style.opacity);
    program.number('halfWidth', style.width / 2);
    program.integer('byAttribute', style.attribute ? 1 : 0);
    if (style.attribute) {
      const { min, max, missing } = style.attribute;
      program.vector2('range', [min, max > min ? 1 / (max - min) : 0]);
      program.colour('missing', missing);
    }
    this.gl.drawArrays(this.gl.TRIANGLES, 6 * first, 6 * (end - first));
  }

  destroy(): void {
    this.program.destroy();
  }
}
