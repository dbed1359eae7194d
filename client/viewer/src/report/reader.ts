export function bytesOfBase64(text: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/** Reads varints and quantised points from the bytes of a frame. */
export class Reader {
  private readonly view: DataView;
  private next = 0;
  private step = 1;
  private x = 0;
  private y = 0;

  constructor(private readonly bytes: Uint8Array<ArrayBuffer>) {
    this.view = new DataView(bytes.buffer);
  }

  origin(): [number, number] {
    const origin: [number, number] = [this.float64(), this.float64()];
    this.step = this.float64();
    return origin;
  }

  count(): number {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = this.bytes[this.next++];
      value |= (byte & 0x7f) << shift;
      if (byte < 0x80) return value >>> 0;
    }
  }

  signed(): number {
    const value = this.count();
    return (value >>> 1) ^ -(value & 1);
  }

  /** x, y of `count` points, relative to the origin. */
  points(count: number): Float32Array {
    const points = new Float32Array(2 * count);
    for (let k = 0; k < 2 * count; k += 2) {
      points[k] = this.step * (this.x += this.signed());
      points[k + 1] = this.step * (this.y += this.signed());
    }
    return points;
  }

  /** A length in world units. */
  length(): number {
    return this.step * this.count();
  }

  byteArray(): Uint8Array {
    const count = this.count();
    this.next += count;
    return this.bytes.subarray(this.next - count, this.next);
  }

  float64(): number {
    this.next += 8;
    return this.view.getFloat64(this.next - 8, true);
  }
}
