// Bulk arrays of messages: bytes, little-endian and packed, as every machine with a browser has them.

interface ArrayType<T> {
  readonly BYTES_PER_ELEMENT: number;
  new (buffer: ArrayBufferLike, byteOffset: number, length: number): T;
}

/** Elements of `bytes`: a view where they are aligned, else a copy. A tail that is no whole element
 * is an error of the sender, which the server has checked. */
export function arrayOf<T>(type: ArrayType<T>, bytes: Uint8Array): T {
  const size = type.BYTES_PER_ELEMENT;
  const length = Math.floor(bytes.byteLength / size);
  if (bytes.byteOffset % size === 0) return new type(bytes.buffer, bytes.byteOffset, length);
  return new type(bytes.slice().buffer, 0, length);
}

/** The bytes of an array, not copied. */
export function bytesOf(array: ArrayBufferView): Uint8Array {
  return new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
}
