/** Natural order of names: digits compare by value, frame_2 < frame_10. */
export function naturalOrder(a: string, b: string): number {
  return compareNames(a, b, []);
}

/**
 * Sorts names of a series by naturalOrder, but compares digits after "<digits>." as the fraction of a decimal number where they
 * have different lengths: p_0.05 < p_0.1. They are whole numbers if they are part of three or more numbers (1.2.10), or if one of
 * them ends with 0 and none longer than the shortest begins with 0 (run1.9 < run1.10). The same order as in natural_order.cc.
 */
export function sortNaturally<T>(items: T[], nameOf: (item: T) => string): T[] {
  const fractions: boolean[] = [];
  const runs = items.map((item) => runsAfterPoint(nameOf(item)));
  for (let ordinal = 0; ; ++ordinal) {
    const same = runs.flatMap((ofName) => ofName.slice(ordinal, ordinal + 1));
    if (same.length === 0) break;
    fractions.push(areFractions(same));
  }
  return items.sort((a, b) => compareNames(nameOf(a), nameOf(b), fractions));
}

interface Run {
  digits: string;
  /** Whether points join more than two numbers here. */
  more: boolean;
}

function runsAfterPoint(name: string): Run[] {
  return [...name.matchAll(/\d+(?:\.\d+)+/g)].flatMap(([joined]) => {
    const [, ...rest] = joined.split('.');
    return rest.map((digits) => ({ digits, more: rest.length > 1 }));
  });
}

function areFractions(runs: Run[]): boolean {
  const lengths = runs.map((run) => run.digits.length);
  const shortest = Math.min(...lengths);
  const start = runs.some((run) => run.digits[0] === '0' && run.digits.length > Math.max(shortest, 1));
  const zeroLast = runs.some((run) => run.digits !== '0' && run.digits.endsWith('0'));
  return lengths.some((length) => length > shortest) && !runs.some((run) => run.more) && (!zeroLast || start);
}

function compareNames(a: string, b: string, fractions: boolean[]): number {
  const partsA = a.split(/(\d+)/);
  const partsB = b.split(/(\d+)/);
  let ordinal = 0;
  for (let k = 0; k < Math.min(partsA.length, partsB.length); ++k) {
    const afterPoint = k % 2 === 1 && k > 1 && partsA[k - 1] === '.';
    const fraction = afterPoint && (fractions[ordinal++] ?? false);
    const order = k % 2 === 0 ? compareText(partsA[k], partsB[k])
      : fraction ? compareText(partsA[k].replace(/0+$/, ''), partsB[k].replace(/0+$/, ''))
        : compareNumbers(partsA[k], partsB[k]);
    if (order !== 0) return order;
  }
  return partsA.length - partsB.length || compareText(a, b);
}

function compareText(a: string, b: string): number {
  return a < b ? -1 : a > b ? 1 : 0;
}

/** Compares digits: without leading zeros the longer number is larger. */
function compareNumbers(a: string, b: string): number {
  const x = a.replace(/^0+/, '');
  const y = b.replace(/^0+/, '');
  return x.length - y.length || compareText(x, y);
}
