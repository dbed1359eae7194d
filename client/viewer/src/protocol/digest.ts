/** A digest in the form of `partiemc replay --stats`. */
export function digestText(digest: bigint): string {
  return digest.toString(16).padStart(16, '0');
}
