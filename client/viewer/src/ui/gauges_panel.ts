import type { Gauges } from '../gauges/gauges';
import { columnsOf, type Gauge, kindOf, parseGauge } from '../gauges/kinds';
import type { Curve } from './curves_panel';
import { block, button, byId, input, make, setText } from './dom';
import { number } from './format';

export function curveOf(gauges: Gauges, gauge: Gauge): Curve {
  const lines = columnsOf(gauge).slice(0, kindOf(gauge).drawn).map((name, k) => ({
    name, value: (summary: Parameters<Gauges['value']>[0]) => gauges.value(summary, gauge, k),
    text: (value: number) => number(value),
  }));
  return { title: `${gauge.name} (${gauge.kind})`, lines };
}

/** A form that adds gauges, and their list. */
export class GaugesPanel {
  private isBlocked = false;

  constructor(private readonly gauges: Gauges, private readonly changed: (curves: Curve[]) => void) {
    byId('gauge-form', HTMLFormElement).addEventListener('submit', (event) => {
      event.preventDefault();
      this.add();
    });
  }

  /** Disables the form for surfaces: gauges measure outlines. */
  offer(hasSurfaces: boolean): void {
    if (hasSurfaces === this.isBlocked) return;
    this.isBlocked = hasSurfaces;
    for (const control of [input('gauge'), button('add-gauge')]) {
      block(control, hasSurfaces ? 'Gauges measure outlines, and this stream has surfaces.' : '');
    }
  }

  private add(): void {
    const field = input('gauge');
    const error = byId('gauge-error', HTMLElement);
    try {
      this.gauges.add(parseGauge(field.value));
      field.value = '';
      error.hidden = true;
      this.show();
    } catch (reason) {
      setText(error, reason instanceof Error ? reason.message : String(reason));
      error.hidden = false;
    }
  }

  private show(): void {
    byId('gauges', HTMLElement).replaceChildren(...this.gauges.all.map((gauge) => {
      const text = `${gauge.name}=${gauge.kind}${gauge.numbers.length > 0 ? ':' : ''}${gauge.numbers.join(',')}`;
      const remove = make('button', {
        type: 'button', class: 'icon', 'aria-label': `Remove ${gauge.name}`, title: 'Removes this gauge and its curve.',
      }, '×');
      remove.addEventListener('click', () => {
        this.gauges.remove(gauge);
        this.show();
      });
      return make('li', {}, make('span', {}, text), remove);
    }));
    this.changed(this.gauges.all.map((gauge) => curveOf(this.gauges, gauge)));
  }
}
