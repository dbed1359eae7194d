/** A digest as `partiemc replay --stats` writes it. */
export function digestText(digest: bigint): string {
  return digest.toString(16).padStart(16, '0');
}
