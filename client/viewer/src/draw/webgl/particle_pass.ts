import { theme } from '../colours';
import type { FrameTextures } from './frame_textures';
import { type Camera, Program } from './program';
import { PARTICLE_ALPHA } from '../style';

const VERTEX = `
uniform sampler2D particles;
uniform float diameter;  // Device pixels.

void main() {
  gl_Position = position(pixel(texelFetch(particles, at(gl_VertexID), 0).rg));
  gl_PointSize = diameter + 2.0;
}
`;

const FRAGMENT = `
uniform float diameter;
uniform vec4 ink;
out vec4 colour;

void main() {
  float away = length(gl_PointCoord - 0.5) * (diameter + 2.0);
  float alpha = ink.a * clamp(0.5 * diameter + 0.5 - away, 0.0, 1.0);
  colour = vec4(ink.rgb * alpha, alpha);
}
`;

/** Particles as round dots. */
export class ParticlePass {
  private readonly program: Program;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.program = new Program(gl, VERTEX, FRAGMENT);
  }

  /** `diameter` in device pixels. */
  draw(
    textures: FrameTextures, camera: Camera, count: number, diameter: number, dark: boolean,
  ): void {
    const { program } = this;
    program.use(camera);
    program.texture('particles', textures.particles);
    program.number('diameter', diameter);
    program.colour('ink', theme(dark).particle, PARTICLE_ALPHA);
    this.gl.drawArrays(this.gl.POINTS, 0, count);
  }

  destroy(): void {
    this.program.destroy();
  }
}
