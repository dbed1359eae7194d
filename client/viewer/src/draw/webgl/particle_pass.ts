import { theme } from '../colours';
import type { FrameTextures } from './frame_textures';
import { type AttributeStyle, type Camera, Programs } from './program';
import { ownDot, ownDotDiameter, PARTICLE_ALPHA } from '../style';

/** Dots of one diameter are points. Own diameters have no limit, so these dots are squares of two triangles. */
const VERTEX = `
uniform sampler2D particles;
uniform sampler2D sizes;   // Own diameters, world units.
uniform vec2 own;          // Device pixels per world unit of an own diameter, and the least diameter of a dot.
uniform float equal;       // Diameter without own ones, device pixels.
uniform sampler2D numbers;
uniform vec2 range;        // Smallest number, and 1 / (largest - smallest).
flat out float value;
flat out float diameter;
out vec2 fromCentre;       // Device pixels; of squares only.

const vec2 CORNERS[6] = vec2[6](
  vec2(-1, -1), vec2(1, -1), vec2(-1, 1), vec2(-1, 1), vec2(1, -1), vec2(1, 1));

void main() {
  int particle = bySize ? gl_VertexID / 6 : gl_VertexID;
  value = byAttribute ? (texelFetch(numbers, at(particle), 0).r - range.x) * range.y : 0.0;
  diameter = bySize ? max(texelFetch(sizes, at(particle), 0).r * own.x, own.y) : equal;
  fromCentre = bySize ? (0.5 * diameter + 1.0) * CORNERS[gl_VertexID % 6] : vec2(0);
  gl_Position = position(pixel(texelFetch(particles, at(particle), 0).rg) + fromCentre);
  gl_PointSize = diameter + 2.0;
}
`;

const FRAGMENT = `
uniform vec4 ink;
uniform vec4 ground;   // Rim of a dot that has the colour of its surroundings.
flat in float value;
flat in float diameter;
in vec2 fromCentre;
out vec4 colour;

void main() {
  float away = bySize ? length(fromCentre) : length(gl_PointCoord - 0.5) * (diameter + 2.0);
  float alpha = ink.a * clamp(0.5 * diameter + 0.5 - away, 0.0, 1.0);
  vec3 base = ink.rgb;
  if (byAttribute) {
    float inside = clamp(0.5 * diameter - 0.75 - away, 0.0, 1.0);
    base = mix(ground.rgb, attributeColour(value).rgb, diameter > 4.0 ? inside : 1.0);
  }
  colour = vec4(base * alpha, alpha);
}
`;

/** How large dots are: of one diameter in device pixels, or by own diameters (`FrameTextures.particleSizes`). */
export interface DotSizes {
  diameter: number;
  /** Null: all have `diameter`. */
  own: { areDiscs: boolean; ratio: number } | null;
}

/** Draws particles as round dots, in one colour or in the colours of an attribute. */
export class ParticlePass {
  private readonly programs: Programs;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.programs = new Programs(gl, VERTEX, FRAGMENT);
  }

  /** `sizes.own.ratio`: device pixels per CSS pixel. */
  draw(
    textures: FrameTextures, camera: Camera, count: number, sizes: DotSizes, dark: boolean,
    attribute: AttributeStyle | null,
  ): void {
    const style = textures.hasParticleColours ? attribute : null;
    const { own } = sizes;
    const { share, alpha } = own ? ownDot(own.areDiscs) : { share: 0, alpha: PARTICLE_ALPHA };
    const program = this.programs.for({ byAttribute: style !== null, bySize: own !== null });
    program.use(camera);
    program.texture('particles', textures.particles);
    program.attribute(style, textures.particleNumbers, textures.ramp);
    program.number('equal', sizes.diameter);
    if (own) {
      program.texture('sizes', textures.particleSizes);
      program.vector2('own', [share * camera.scale, own.ratio * ownDotDiameter(0)]);
    }
    program.colour('ground', theme(dark).background);
    program.colour('ink', theme(dark).particle, alpha);
    if (own) this.gl.drawArrays(this.gl.TRIANGLES, 0, 6 * count);
    else this.gl.drawArrays(this.gl.POINTS, 0, count);
  }

  destroy(): void {
    this.programs.destroy();
  }
}
