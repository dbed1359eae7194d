// Checks of messages, as in proto/wire/result_codec.cc and surface_codec.cc. A message that contradicts
// itself is refused with a sentence that names the field.
import { arrayOf } from './arrays';

/** The name of closed curves or surfaces in error messages. */
export type Owner = 'ring' | 'shell';

/** The entry of an outer ring or shell in `outerOf`. */
export const NO_OUTER = 0xffffffff;

/** The error for a message that contradicts itself. */
export function lost(field: string, rule: string): Error {
  return new Error(`${field} ${rule}.`);
}

/**
 * Reads offsets: a view of `bytes` if they are aligned, else a copy. Throws unless the first offset is 0 and each ring
 * or shell has at least `fewest` points or triangles.
 */
export function offsetsOf(bytes: Uint8Array, field: string, owner: Owner, fewest: number): Uint32Array {
  if (bytes.length % 4 !== 0) throw lost(field, 'is no array of uint32');
  const offsets = arrayOf(Uint32Array, bytes);
  if (offsets.length === 0 || offsets[0] !== 0) throw lost(field, 'must begin with 0');
  for (let k = 0; k + 1 < offsets.length; ++k) {
    if (offsets[k + 1] < offsets[k] + fewest) throw lost(field, `gives ${owner} ${k} fewer than ${fewest}`);
  }
  return offsets;
}

/** Returns a check that throws unless `isRight`: the field must have `unit` for each of the `count` rings or shells. */
export function countCheck(owner: Owner, count: number): (isRight: boolean, field: string, unit: string) => void {
  return (isRight, field, unit) => {
    if (!isRight) throw lost(field, `must have ${unit} for each of the ${count} ${owner}s`);
  };
}

/** Throws unless `outerOf` names an outer ring or shell for each hole or cavity. */
export function checkNesting(outerOf: Uint32Array, field: string, owner: Owner): void {
  outerOf.forEach((outer, k) => {
    if (outer === NO_OUTER || (outer < outerOf.length && outerOf[outer] === NO_OUTER)) return;
    throw lost(field, `names ${owner} ${outer} for ${owner} ${k}, which is no outer ${owner}`);
  });
}
