import type { Rgb } from '../colours';
import type { FrameTextures, RingTextures } from './frame_textures';
import { type AttributeStyle, type Camera, Programs } from './program';

const VERTEX = `
uniform sampler2D points;
uniform usampler2D ringOf;
uniform usampler2D rings;     // First vertex, end vertex, colour, unused.
uniform sampler2D numbers;
uniform vec2 range;           // Smallest number, and 1 / (largest - smallest).
uniform vec4 single;          // One colour for all, if its alpha is 1.
uniform float halfWidth;      // Device pixels.
flat out vec2 along;          // From the first to the second end of the segment.
flat out vec2 firstSplit;     // Tangents of the outline at both ends.
flat out vec2 secondSplit;
flat out vec4 ringColour;
flat out vec2 values;         // The attribute at both ends, 0 to 1.
flat out vec2 begin;          // The first end, from the canvas's lower left corner.

// Tangent at a corner: the sum of both directions, or own if the outline turns back.
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
  uint word = texelFetch(ringOf, at(index), 0).r;
  if (isCut(word)) {
    gl_Position = vec4(2.0, 2.0, 0.0, 1.0);  // Beside the picture.
    return;
  }
  uvec4 ring = texelFetch(rings, at(ringAt(word)), 0);
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
  // gl_FragCoord instead of an interpolated position: triangle corners are rounded before filling.
  vec2 offset = gl_FragCoord.xy - begin;  // From the first end.
  // Each pixel near a corner belongs to one of its two segments, so none is covered twice.
  if (dot(offset, firstSplit) < 0.0 || dot(offset - along, secondSplit) >= 0.0) discard;
  float share = clamp(dot(offset, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
  float away = distance(offset, along * share);
  // A line thinner than a pixel is a pixel wide and lighter.
  float cover = clamp(max(halfWidth, 0.5) + 0.5 - away, 0.0, 1.0) * min(2.0 * halfWidth, 1.0);
  vec4 base = ringColour;
  if (byAttribute) base = attributeColour(mix(values.x, values.y, share));
  float alpha = opacity * cover;
  colour = vec4(base.rgb * alpha, alpha);
}
`;

/** Style of the outline, or of a part of it. */
export interface LineStyle {
  /** Device pixels. */
  width: number;
  /** One colour for all. Null: the colour of each ring, or of the attribute. */
  colour: Rgb | null;
  opacity: number;
  attribute: AttributeStyle | null;
}

/**
 * The rings as lines with round joins. Coverage is computed from the distance to the segment, so
 * lines are smooth without multisampling, at any width and on any screen.
 */
export class LinePass {
  private readonly programs: Programs;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.programs = new Programs(gl, VERTEX, FRAGMENT);
  }

  /** Draws the segments that begin at the vertices [first, end) of the rings. */
  draw(
    rings: RingTextures, textures: FrameTextures, camera: Camera, style: LineStyle,
    [first, end]: readonly [number, number] = [0, rings.count],
  ): void {
    const attribute = textures.hasOutlineColours ? style.attribute : null;
    const program = this.programs.for({ byAttribute: attribute !== null });
    program.use(camera);
    program.texture('points', rings.points);
    program.texture('ringOf', rings.ringOf);
    program.texture('rings', rings.rings);
    program.attribute(attribute, textures.attribute, textures.ramp);
    program.colour('single', style.colour ?? [0, 0, 0], style.colour ? 1 : 0);
    program.number('opacity', style.opacity);
    program.number('halfWidth', style.width / 2);
    this.gl.drawArrays(this.gl.TRIANGLES, 6 * first, 6 * (end - first));
  }

  destroy(): void {
    this.programs.destroy();
  }
}
