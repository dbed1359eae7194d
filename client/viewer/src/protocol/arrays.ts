// Arrays in messages are packed little-endian bytes. Every machine with a browser is little-endian, so
// arrays can be views of these bytes.

interface ArrayType<T> {
  readonly BYTES_PER_ELEMENT: number;
  new (buffer: ArrayBufferLike, byteOffset: number, length: number): T;
}

/** Elements of `bytes`: a view if they are aligned, else a copy. Bytes after the last whole element
 * are ignored. */
export function arrayOf<T>(type: ArrayType<T>, bytes: Uint8Array): T {
  const size = type.BYTES_PER_ELEMENT;
  const length = Math.floor(bytes.byteLength / size);
  if (bytes.byteOffset % size === 0) return new type(bytes.buffer, bytes.byteOffset, length);
  return new type(bytes.slice().buffer, 0, length);
}

/** View of the bytes of an array. */
export function bytesOf(array: ArrayBufferView): Uint8Array {
  return new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
}
