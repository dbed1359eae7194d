import type { Entry, Summary } from '../stream/history';
import type { Gauge } from './kinds';
import { measure } from './measure';
import { ringsOf } from './rings';

/** The gauges of the page, and their values for the frames of histories. */
export class Gauges {
  all: readonly Gauge[] = [];
  /** By frame, then by gauge. */
  private readonly values = new WeakMap<Summary, Map<Gauge, readonly number[]>>();

  /** Adds a gauge, and removes one with the same name. */
  add(gauge: Gauge): void {
    this.all = [...this.all.filter(({ name }) => name !== gauge.name), gauge];
  }

  remove(gauge: Gauge): void {
    this.all = this.all.filter((one) => one !== gauge);
  }

  /** Value k of a gauge; NaN if the frame is not measured yet. */
  value(summary: Summary, gauge: Gauge, k: number): number {
    return this.values.get(summary)?.get(gauge)?.[k] ?? NaN;
  }

  /** Decodes and measures frames that lack values, the newest first, until `isLate()`. */
  measure(entries: readonly (Entry | null)[], isLate: () => boolean): void {
    if (this.all.length === 0) return;
    for (let k = entries.length; k-- > 0 && !isLate();) {
      const entry = entries[k];
      if (entry) this.measureEntry(entry);
    }
  }

  private measureEntry(entry: Entry): void {
    const known = this.values.get(entry.summary) ?? new Map<Gauge, readonly number[]>();
    const missing = this.all.filter((gauge) => !known.has(gauge));
    if (missing.length === 0) return;
    const outline = ringsOf(entry.frame());
    for (const gauge of missing) known.set(gauge, measure(gauge, outline));
    this.values.set(entry.summary, known);
  }
}
