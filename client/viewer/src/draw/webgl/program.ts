import type { Rgb } from '../colours';
import type { DataTexture } from './data_texture';

/** What the shaders of all passes have in common. */
const COMMON = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
`;

const COMMON_VERTEX = `${COMMON}
uniform vec2 centre;  // World coordinates of the canvas's middle, relative to the origin.
uniform float scale;  // Device pixels per unit of length.
uniform vec2 size;    // Of the canvas in device pixels.

// Where an array's element stands in its texture, whose rows have 2048.
ivec2 at(int index) { return ivec2(index & 2047, index >> 11); }

// Device pixels right of and above the middle of the canvas.
vec2 pixel(vec2 point) { return (point - centre) * scale; }

vec4 position(vec2 pixels) { return vec4(2.0 * pixels / size, 0.0, 1.0); }

vec4 unpacked(uint colour) {
  return vec4(uvec4(colour, colour >> 8, colour >> 16, colour >> 24) & 255u) / 255.0;
}
`;

/** A view as the shaders take it. */
export interface Camera {
  /** World coordinates relative to the frame's origin. */
  centre: [number, number];
  /** Device pixels per unit of length. */
  scale: number;
  /** Device pixels. */
  width: number;
  height: number;
}

/** A vertex and a fragment shader with their uniforms, found by name once. */
export class Program {
  private readonly program: WebGLProgram;
  private readonly locations = new Map<string, WebGLUniformLocation | null>();
  private readonly units = new Map<string, number>();

  /** Throws where a shader does not compile: a mistake of ours, or a context that is lost. */
  constructor(
    private readonly gl: WebGL2RenderingContext, vertex: string, fragment: string,
  ) {
    this.program = gl.createProgram();
    const shaders = [
      this.attach(gl.VERTEX_SHADER, COMMON_VERTEX + vertex),
      this.attach(gl.FRAGMENT_SHADER, COMMON + fragment),
    ];
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) {
      const logs = shaders.map((shader) => gl.getShaderInfoLog(shader) ?? '');
      throw new Error(`shader: ${gl.getProgramInfoLog(this.program) ?? ''} ${logs.join(' ')}`);
    }
    for (const shader of shaders) gl.deleteShader(shader);
  }

  /** Makes it the program of the draws that follow, seen through the camera. */
  use(camera: Camera): void {
    this.gl.useProgram(this.program);
    this.vector2('centre', camera.centre);
    this.number('scale', camera.scale);
    this.vector2('size', [camera.width, camera.height]);
  }

  number(name: string, value: number): void {
    this.gl.uniform1f(this.location(name), value);
  }

  integer(name: string, value: number): void {
    this.gl.uniform1i(this.location(name), value);
  }

  vector2(name: string, value: readonly [number, number]): void {
    this.gl.uniform2f(this.location(name), value[0], value[1]);
  }

  vector3(name: string, value: readonly [number, number, number]): void {
    this.gl.uniform3f(this.location(name), value[0], value[1], value[2]);
  }

  colour(name: string, value: Rgb, alpha = 1): void {
    this.gl.uniform4f(this.location(name), value[0], value[1], value[2], alpha);
  }

  /** The array that the sampler of this name reads. */
  texture(name: string, texture: Pick<DataTexture, 'bind'>): void {
    let unit = this.units.get(name);
    if (unit === undefined) {
      unit = this.units.size;
      this.units.set(name, unit);
      this.integer(name, unit);
    }
    texture.bind(unit);
  }

  destroy(): void {
    this.gl.deleteProgram(this.program);
  }

  private attach(type: GLenum, source: string): WebGLShader {
    const shader = this.gl.createShader(type);
    if (!shader) throw new Error('the graphics context is lost');
    this.gl.shaderSource(shader, source);
    this.gl.compileShader(shader);
    this.gl.attachShader(this.program, shader);
    return shader;
  }

  private location(name: string): WebGLUniformLocation | null {
    let location = this.locations.get(name);
    if (location === undefined) {
      location = this.gl.getUniformLocation(this.program, name);
      this.locations.set(name, location);
    }
    return location;
  }
}
