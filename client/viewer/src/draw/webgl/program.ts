import type { Rgb } from '../colours';
import type { DataTexture } from './data_texture';

/** Common part of all shaders, after their version and their switches. */
const COMMON = `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
`;

const COMMON_VERTEX = `${COMMON}
uniform vec2 centre;  // World coordinates of the canvas centre, relative to the origin.
uniform float scale;  // Device pixels per unit of length.
uniform vec2 size;    // The canvas in device pixels.

// Texel of an array element, in rows of 2048.
ivec2 at(int index) { return ivec2(index & 2047, index >> 11); }

// Device pixels to the right and above the canvas centre.
vec2 pixel(vec2 point) { return (point - centre) * scale; }

vec4 position(vec2 pixels) { return vec4(2.0 * pixels / size, 0.0, 1.0); }

// The ring of a vertex, and whether its segment is not drawn (ring_table.ts).
int ringAt(uint word) { return int(word & 0x7fffffffu); }
bool isCut(uint word) { return word >> 31 == 1u; }

vec4 unpacked(uint colour) {
  return vec4(uvec4(colour, colour >> 8, colour >> 16, colour >> 24) & 255u) / 255.0;
}
`;

/** The attribute's colour in fragment shaders; see `Program.attribute`. */
const COMMON_FRAGMENT = `${COMMON}
uniform sampler2D ramp;
uniform vec4 missing;

// value is 0 to 1. NaN and huge numbers, which an interpolated infinity gives, are missing.
vec4 attributeColour(float value) {
  bool known = value == value && abs(value) < 1e30;
  return known ? texture(ramp, vec2(value * (255.0 / 256.0) + 0.5 / 256.0, 0.5)) : missing;
}
`;

/** An attribute's range, and the colour of points without a number. */
export interface AttributeStyle { min: number; max: number; missing: Rgb }

export interface Camera {
  /** World coordinates relative to the frame's origin. */
  centre: [number, number];
  /** Device pixels per unit of length. */
  scale: number;
  /** Device pixels. */
  width: number;
  height: number;
}

/** Names of constants of the shaders, and whether they are true. */
export type Switches = Readonly<Record<string, boolean>>;

/**
 * Programs of one vertex and one fragment shader, one for each set of switches, compiled when it is first used. Switches
 * are constants, because software rendering executes both branches of an `if` on a uniform.
 */
export class Programs {
  private readonly compiled = new Map<string, Program>();

  constructor(private readonly gl: WebGL2RenderingContext, private readonly vertex: string,
              private readonly fragment: string) {}

  /** `switches`: the same names in each call. Throws as the constructor of Program. */
  for(switches: Switches): Program {
    const lines = Object.entries(switches).map(([name, isOn]) => `const bool ${name} = ${isOn};`).join('\n');
    const known = this.compiled.get(lines);
    if (known) return known;
    const program = new Program(this.gl, this.vertex, this.fragment, lines);
    this.compiled.set(lines, program);
    return program;
  }

  destroy(): void {
    for (const program of this.compiled.values()) program.destroy();
  }
}

/** A vertex and a fragment shader with their uniforms. Caches uniform locations. */
export class Program {
  private readonly program: WebGLProgram;
  private readonly locations = new Map<string, WebGLUniformLocation | null>();
  private readonly units = new Map<string, number>();

  /** `constants`: lines before both shaders. Throws if a shader does not compile: an internal error. */
  constructor(
    private readonly gl: WebGL2RenderingContext, vertex: string, fragment: string, constants = '',
  ) {
    this.program = gl.createProgram();
    const shaders = [
      this.attach(gl.VERTEX_SHADER, `#version 300 es\n${constants}${COMMON_VERTEX}${vertex}`),
      this.attach(gl.FRAGMENT_SHADER, `#version 300 es\n${constants}${COMMON_FRAGMENT}${fragment}`),
    ];
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = shaders.map((shader) => (shader && gl.getShaderInfoLog(shader)) ?? '');
      throw new Error(`shader: ${gl.getProgramInfoLog(this.program) ?? ''} ${logs.join(' ')}`);
    }
    for (const shader of shaders) gl.deleteShader(shader);
  }

  /** Selects the program for the draws that follow, and sets the camera. */
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

  /** Binds an array to the sampler of this name. */
  texture(name: string, texture: Pick<DataTexture, 'bind'>): void {
    let unit = this.units.get(name);
    if (unit === undefined) {
      unit = this.units.size;
      this.units.set(name, unit);
      this.integer(name, unit);
    }
    texture.bind(unit);
  }

  /** Sets `numbers`, `range` and the colours of an attribute, for shaders with the switch `byAttribute`. */
  attribute(
    style: AttributeStyle | null, numbers: Pick<DataTexture, 'bind'>, ramp: Pick<DataTexture, 'bind'>,
  ): void {
    if (!style) return;
    this.texture('numbers', numbers);
    this.texture('ramp', ramp);
    const { min, max, missing } = style;
    this.vector2('range', [min, max > min ? 1 / (max - min) : 0]);
    this.colour('missing', missing);
  }

  destroy(): void {
    this.gl.deleteProgram(this.program);
  }

  /** Null: the context is lost. */
  private attach(type: GLenum, source: string): WebGLShader | null {
    const shader = this.gl.createShader(type);
    if (!shader) return null;
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
