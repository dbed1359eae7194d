import { DEFAULT_LOOK, type Legend, type Look } from '../draw';
import { byId, input, select, setText } from './dom';
import { number } from './format';

const SWITCHES = {
  outline: 'outline', fill: 'fill-look', edges: 'edges', particles: 'particles', normals: 'normals',
  isolines: 'isolines',
} as const;
export type Switch = keyof typeof SWITCHES;
const NAMES = Object.keys(SWITCHES) as Switch[];

/** Controls of the look. */
export class LookPanel {
  private chosen: Look = { ...DEFAULT_LOOK };

  constructor(private readonly changed: () => void) {
    for (const name of NAMES) {
      input(SWITCHES[name]).addEventListener('change', (event) => {
        this.set({ [name]: (event.target as HTMLInputElement).checked });
      });
    }
    select('colour').addEventListener('change', () => this.set({ colour: select('colour').value }));
    input('line-width').addEventListener('input', () => {
      this.set({ lineWidth: input('line-width').valueAsNumber });
    });
    this.reflect();
  }

  get look(): Look { return this.chosen; }

  setDark(dark: boolean): void { this.set({ dark }); }

  /** Sets the names of the frame's attributes. */
  setAttributes(names: string[]): void {
    const colour = select('colour');
    const values = ['plain', 'identity', ...names];
    const current = [...colour.options].map((option) => option.value);
    if (values.join('\n') === current.join('\n')) return;
    while (colour.options.length > 2) colour.remove(2);
    for (const name of names) colour.add(new Option(`by ${name}`, name));
    if (!values.includes(this.chosen.colour)) this.set({ colour: 'plain' });
    colour.value = this.chosen.colour;
  }

  /** Offers the switch of isolines, which few frames have. */
  offerIsolines(): void {
    input('isolines').parentElement?.removeAttribute('hidden');
  }

  toggle(name: Switch): void { this.set({ [name]: !this.chosen[name] }); }

  setColour(colour: string): void { this.set({ colour }); }

  setLegend(legend: Legend | null): void {
    byId('legend', HTMLElement).hidden = legend === null;
    if (!legend) return;
    setText(byId('legend-min', HTMLElement), number(legend.min, 4));
    setText(byId('legend-max', HTMLElement), number(legend.max, 4));
    const bar = byId('legend-bar', HTMLElement);
    bar.style.background = `linear-gradient(to right, ${legend.stops.join(', ')})`;
    bar.setAttribute('aria-label', `${this.chosen.colour}, from left to right`);
  }

  /** The look in the page's address; empty if it is the default. */
  get text(): string {
    const { colour, lineWidth } = this.chosen;
    const text = [...NAMES.filter((name) => this.chosen[name]), `colour:${colour}`,
      `width:${lineWidth}`].join(',');
    const normal = [...NAMES.filter((name) => DEFAULT_LOOK[name]), `colour:${DEFAULT_LOOK.colour}`,
      `width:${DEFAULT_LOOK.lineWidth}`].join(',');
    return text === normal ? '' : text;
  }

  set text(text: string) {
    if (!text) return;
    const parts = text.split(',');
    const value = (name: string) => parts.find((part) => part.startsWith(`${name}:`))?.slice(name.length + 1);
    const switches = Object.fromEntries(NAMES.map((name) => [name, parts.includes(name)]));
    const lineWidth = Number(value('width'));
    this.set({
      ...switches, colour: value('colour') ?? 'plain',
      lineWidth: lineWidth > 0 ? lineWidth : DEFAULT_LOOK.lineWidth,
    });
  }

  private set(change: Partial<Look>): void {
    this.chosen = { ...this.chosen, ...change };
    this.reflect();
    this.changed();
  }

  private reflect(): void {
    for (const name of NAMES) input(SWITCHES[name]).checked = this.chosen[name];
    select('colour').value = this.chosen.colour;
    input('line-width').valueAsNumber = this.chosen.lineWidth;
  }
}
