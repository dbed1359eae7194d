/** Natural order of names: digits compare by value, frame_2 < frame_10. */
export function naturalOrder(a: string, b: string): number {
  const partsA = a.split(/(\d+)/);
  const partsB = b.split(/(\d+)/);
  for (let k = 0; k < Math.min(partsA.length, partsB.length); ++k) {
    const order = k % 2 === 1 ? compareNumbers(partsA[k], partsB[k]) : compareText(partsA[k], partsB[k]);
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
