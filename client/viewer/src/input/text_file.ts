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

/** The name in lower case, without .gz or .zst. */
export function plainName(file: File): string {
  return file.name.toLowerCase().replace(/\.(gz|zst)$/, '');
}
