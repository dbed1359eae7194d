/** A number with `digits` significant digits, without trailing zeros; a dash if it is not finite. */
export function number(value: number, digits = 5): string {
  if (!Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1).replace(/\.?0+e/, 'e');
  return String(Number(value.toPrecision(digits)));
}

const thousands = new Intl.NumberFormat('en', { useGrouping: true });

/** A count with separators: 12,345; a dash if it is unknown. */
export function count(value: number): string {
  return Number.isFinite(value) ? thousands.format(value) : '–';
}
