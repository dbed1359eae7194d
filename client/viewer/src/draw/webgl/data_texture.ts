/** Texels per row, which every WebGL2 supports. `at` in the shaders (program.ts) contains its logarithm. */
const WIDTH = 2048;

/** Factor of spare rows, so that a growing stream rarely reallocates. */
const GROWTH = 1.25;

/** Format of a texel: names of WebGL2 constants, and bytes per texel. */
interface TexelFormat {
  internal: 'RG32F' | 'R32F' | 'R32UI' | 'R8UI' | 'RGBA32UI';
  format: 'RG' | 'RED' | 'RED_INTEGER' | 'RGBA_INTEGER';
  type: 'FLOAT' | 'UNSIGNED_INT' | 'UNSIGNED_BYTE';
  bytes: number;
}

export const TEXELS = {
  float: { internal: 'R32F', format: 'RED', type: 'FLOAT', bytes: 4 },
  float2: { internal: 'RG32F', format: 'RG', type: 'FLOAT', bytes: 8 },
  uint8: { internal: 'R8UI', format: 'RED_INTEGER', type: 'UNSIGNED_BYTE', bytes: 1 },
  uint32: { internal: 'R32UI', format: 'RED_INTEGER', type: 'UNSIGNED_INT', bytes: 4 },
  uint32x4: { internal: 'RGBA32UI', format: 'RGBA_INTEGER', type: 'UNSIGNED_INT', bytes: 16 },
} as const satisfies Record<string, TexelFormat>;

/**
 * An array that shaders read by index (`texelFetch(name, at(index), 0)`). Arrays of a message are
 * uploaded as they are. The texture grows and never shrinks.
 */
export class DataTexture {
  private texture: WebGLTexture | null = null;
  private rows = 0;
  private staging: WebGLBuffer | null = null;
  private staged = 0;

  constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly texels: TexelFormat,
  ) {}

  /**
   * Replaces the content by numbers or by their bytes, in any alignment. Throws a RangeError if the
   * array exceeds the largest texture.
   */
  upload(data: Float32Array | Uint32Array | Uint8Array): void {
    const { gl } = this;
    const { format, type, bytes } = this.texels;
    const count = Math.floor(data.byteLength / bytes);
    const full = Math.floor(count / WIDTH);
    const rest = count - full * WIDTH;
    this.reserve(full + (rest > 0 ? 1 : 0));
    this.stage(data);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    if (full > 0) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDTH, full, gl[format], gl[type], 0);
    }
    if (rest > 0) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, full, rest, 1, gl[format], gl[type],
        full * WIDTH * bytes);
    }
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  }

  bind(unit: number): void {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    if (!this.texture) this.reserve(1);
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.texture);
  }

  destroy(): void {
    const { gl } = this;
    gl.deleteTexture(this.texture);
    gl.deleteBuffer(this.staging);
    this.texture = null;
    this.staging = null;
    this.rows = 0;
    this.staged = 0;
  }

  /** Copies to a buffer, because a texture requires aligned numbers. */
  private stage(data: ArrayBufferView): void {
    const { gl } = this;
    this.staging ??= gl.createBuffer();
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, this.staging);
    if (data.byteLength > this.staged) {
      this.staged = Math.ceil(GROWTH * data.byteLength);
      gl.bufferData(gl.PIXEL_UNPACK_BUFFER, this.staged, gl.STREAM_DRAW);
    }
    gl.bufferSubData(gl.PIXEL_UNPACK_BUFFER, 0, data);
  }

  private reserve(rows: number): void {
    if (this.texture && rows <= this.rows) return;
    const { gl } = this;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE) as number;
    if (rows > most) {
      throw new RangeError(
        `The frame has ${rows * WIDTH} points or indices. The limit of this graphics card is ` +
        `${most * WIDTH}. Choose another fill or a larger cell size.`);
    }
    gl.deleteTexture(this.texture);
    this.texture = gl.createTexture();
    this.rows = Math.min(Math.max(1, Math.ceil(rows * GROWTH)), most);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl[this.texels.internal], WIDTH, this.rows);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    }
  }
}
