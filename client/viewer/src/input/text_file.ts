import { decompress } from 'fzstd';

/** Text of a file. Decompresses .gz and .zst. */
export async function textOf(file: File): Promise<string> {
  if (file.name.endsWith('.gz')) {
    return new Response(file.stream().pipeThrough(new DecompressionStream('gzip'))).text();
  }
  if (file.name.endsWith('.zst')) {
    return new TextDecoder().decode(decompress(new Uint8Array(await file.arrayBuffer())));
  }
  return file.text();
}

/** Bytes of a file. Decompresses .gz and .zst; other files are read on demand. */
export async function blobOf(file: File): Promise<Blob> {
  if (file.name.endsWith('.gz')) {
    return new Response(file.stream().pipeThrough(new DecompressionStream('gzip'))).blob();
  }
  if (file.name.endsWith('.zst')) return new Blob([decompress(new Uint8Array(await file.arrayBuffer())) as BlobPart]);
  return file;
}

/** The name in lower case, without .gz or .zst. */
export function plainName(file: File): string {
  return file.name.toLowerCase().replace(/\.(gz|zst)$/, '');
}
