import { DEFAULT_LOOK, NO_WEBGL, type Legend, type Look } from '../draw';
import type { Frame } from '../protocol/frame';
import { attributeOf } from '../draw/look';
import { hex } from '../draw/colours';
import { isolineColour } from '../draw/look_colours';
import { MAP_NAMES, type MapName } from '../draw/ramp';
import { channelLabel } from '../protocol/channels';
import { outlineName, shiftBetween, type Outline } from '../protocol/sections';
import type { Track } from '../stream/track';
import { block, byId, input, make, select, setText } from './dom';
import { number } from './format';

const SWITCHES = {
  outline: 'outline', fill: 'fill-look', edges: 'edges', particles: 'particles', normals: 'normals',
  sections: 'sections', axes: 'axes',
} as const;
const TITLES: Record<keyof typeof SWITCHES, string> = {
  outline: 'Draws the outline as a line.', fill: 'Fills the inside of the outline.',
  edges: 'Draws the edges of the triangles.', particles: 'Draws the particles as dots.',
  normals: 'Draws the normals of the outline.', sections: 'Draws the other outlines in this plane as lines.', axes: 'Shows coordinates along the edges of the picture.',
};
/** Tooltips for a picture of surfaces, if they differ. */
const SPACE_TITLES: Partial<Record<keyof typeof SWITCHES, string>> = {
  fill: 'Draws the surface.', particles: 'Draws the particles as dots, which an opaque surface hides.',
  sections: 'Draws the sections as lines in their planes.', axes: 'Shows coordinates along the box of the surface.',
};
const NO_OUTLINE = 'A surface has no outline, so choose a section under "Picture of".';
export type Switch = keyof typeof SWITCHES;
const NAMES = Object.keys(SWITCHES) as Switch[];

/** Controls of the look. */
export class LookPanel {
  private chosen: Look = { ...DEFAULT_LOOK };
  /** State of the list of outlines. */
  private outlineState = '';
  /** Names of attributes of a track. */
  private readonly offered = new Set<string>();
  private offeredOf: object | null = null;

  constructor(private readonly changed: () => void) {
    for (const name of NAMES) {
      const label = input(SWITCHES[name]).parentElement;
      if (label) label.title = TITLES[name];
      input(SWITCHES[name]).addEventListener('change', (event) => {
        this.set({ [name]: (event.target as HTMLInputElement).checked });
      });
    }
    select('outline-shown').addEventListener('change', () => {
      this.set({ outlineShown: Number(select('outline-shown').value) });
    });
    for (const name of MAP_NAMES) select('map').add(new Option(name.replace('-', ' to '), name));
    select('colour').addEventListener('change', () => this.setColour(select('colour').value));
    select('map').addEventListener('change', () => this.set({ map: select('map').value as MapName }));
    for (const name of ['from', 'to'] as const) {
      input(name).addEventListener('change', () => this.readRange(name));
    }
    input('line-width').addEventListener('input', () => {
      this.set({ lineWidth: input('line-width').valueAsNumber });
    });
    this.reflect();
  }

  get look(): Look { return this.chosen; }

  setDark(dark: boolean): void { this.set({ dark }); }

  /**
   * Offers the attributes of a frame, and of earlier frames of its track: a frame can be without its
   * attributes for a moment. The chosen attribute stays on offer; a frame without it has one colour.
   */
  setAttributes(ofFrame: readonly string[], track: object | null): void {
    if (track !== this.offeredOf) this.offered.clear();
    this.offeredOf = track;
    for (const name of ofFrame) this.offered.add(name);
    const { colour: chosen } = this.chosen;
    const names = offeredChannels(this.offered, chosen);
    const colour = select('colour');
    const values = ['plain', 'identity', ...names];
    const current = [...colour.options].map((option) => option.value);
    if (values.join('\n') === current.join('\n')) return;
    while (colour.options.length > 2) colour.remove(2);
    for (const name of names) colour.add(new Option(`by ${channelLabel(name, names)}`, name));
    colour.value = this.chosen.colour;
  }

  /** Lists the outlines of a frame: a line for each, and the choice of the picture. */
  setOutlines(outlines: readonly Outline[]): void {
    const { dark, hidden, outlineShown } = this.chosen;
    const names = outlines.map(outlineName);
    const state = [...names, dark, hidden, outlineShown].join('|');
    if (state === this.outlineState) return;
    this.outlineState = state;
    const isOffered = outlines.length > 1;
    byId('outlines', HTMLElement).hidden = !isOffered;
    input('sections').parentElement?.toggleAttribute('hidden', !isOffered);
    const picture = select('outline-shown');
    picture.replaceChildren(...names.map((name, k) => new Option(name, String(k))));
    const shown = outlineShown < outlines.length ? outlineShown : 0;
    picture.value = String(shown);
    byId('outline-list', HTMLElement).replaceChildren(...outlines.map((outline, k) =>
      this.outlineItem(names[k], k, shown, outlines[shown].isSurface || shiftBetween(outline.plane, outlines[shown].plane) !== null,
        outline.isSurface ?? false)));
  }

  private outlineItem(name: string, index: number, shown: number, isParallel: boolean, isSurface: boolean): HTMLElement {
    const { dark, hidden } = this.chosen;
    const box = make('input', { type: 'checkbox' });
    box.checked = index !== shown && isParallel && !hidden.includes(index);
    box.disabled = index === shown || !isParallel;
    box.addEventListener('change', () => this.set({
      hidden: box.checked ? hidden.filter((one) => one !== index) : [...hidden, index].sort((a, b) => a - b),
    }));
    const swatch = make('i', { style: `background: ${hex(isolineColour(index, dark))}` });
    const note = index === shown ? ', the picture' : isParallel ? '' : isSurface ? ', in space' : ', another plane';
    const label = make('label', {}, box, swatch, name + note);
    label.title = index === shown ? 'This outline is the picture.'
      : isParallel ? `Draws ${name} as lines.`
        : isSurface ? 'Choose it under "Picture of" to see it in space.' : 'Its plane is not parallel to the plane of the picture, so choose it under "Picture of".';
    return make('li', {}, label);
  }

  /** Disables the switches of parts that the frame lacks, with the reason. Without WebGL, says so. */
  offer(frame: Frame | null, kind: Track['kind'], hasWebgl: boolean, isSpace = false): void {
    const remedy = (text: string) => (kind === 'watch' ? ` ${text}` : '');
    // For a dropped file, the page draws the particles of the file, so they are never missing.
    const missing: Partial<Record<Switch, string>> = isSpace ? {
      outline: NO_OUTLINE, normals: NO_OUTLINE, edges: '', fill: '', sections: '', axes: '',
      particles: frame?.surface?.particles.length === 0
        ? `This frame has no particles.${remedy('Start its producer with --echo-particles.')}` : '',
    } : {
      outline: '', fill: '', sections: '', axes: '', edges: frame && !frame.mesh ? 'This frame has no mesh.' : '',
      particles: frame && !frame.particles && kind !== 'file'
        ? `This frame has no particles.${remedy('Start its producer with --echo-particles.')}` : '',
      normals: frame && !frame.rings.normals
        ? `This frame has no normals.${remedy('Its producer must request them (Outputs.normals).')}` : '',
    };
    for (const [name, reason] of Object.entries(missing) as [Switch, string][]) {
      const control = input(SWITCHES[name]);
      control.disabled = reason !== '';
      const label = control.parentElement;
      const title = reason || (isSpace && SPACE_TITLES[name]) || TITLES[name];
      if (label && label.title !== title) label.title = title;
    }
    const ofRings = isSpace ? 'Measurements are of outlines, so choose a section under "Picture of".' : '';
    if (select('measure').disabled !== isSpace) block(select('measure'), ofRings);
    byId('no-webgl', HTMLElement).hidden = hasWebgl;
    setText(byId('no-webgl', HTMLElement), hasWebgl ? '' : NO_WEBGL);
  }

  toggle(name: Switch): void { this.set({ [name]: !this.chosen[name] }); }

  /** Resets the range, because it belongs to the previous attribute. */
  setColour(colour: string): void {
    if (colour !== this.chosen.colour) this.set({ colour, from: null, to: null });
  }

  setLegend(legend: Legend | null): void {
    byId('legend', HTMLElement).hidden = legend === null;
    if (!legend) return;
    setText(byId('legend-name', HTMLElement), legend.name);
    setText(byId('legend-min', HTMLElement), number(legend.min, 4));
    setText(byId('legend-max', HTMLElement), number(legend.max, 4));
    const bar = byId('legend-bar', HTMLElement);
    bar.style.background = `linear-gradient(to right, ${legend.stops.join(', ')})`;
    bar.setAttribute('aria-label', `${legend.name}, from left to right`);
  }

  /** The look in the page's address; empty if it is the default. */
  get text(): string {
    const text = lookText(this.chosen);
    return text === lookText(DEFAULT_LOOK) ? '' : text;
  }

  set text(text: string) {
    if (!text) return;
    const parts = text.split(',');
    const value = (name: string) => parts.find((part) => part.startsWith(`${name}:`))?.slice(name.length + 1);
    const switches = Object.fromEntries(NAMES.map((name) => [name, parts.includes(name)]));
    const lineWidth = Number(value('width'));
    const number = (name: string) => {
      const given = value(name);
      return given && Number.isFinite(Number(given)) ? Number(given) : null;
    };
    this.set({
      ...switches, colour: value('colour') ?? 'plain',
      map: MAP_NAMES.find((name) => name === value('map')) ?? DEFAULT_LOOK.map,
      hidden: (value('hidden') ?? '').split('.').filter(Boolean).map(Number).filter(Number.isInteger),
      outlineShown: Math.max(0, Math.trunc(number('of') ?? 0)),
      ...rangeOf(number('from'), number('to')),
      lineWidth: lineWidth > 0 ? lineWidth : DEFAULT_LOOK.lineWidth,
    });
  }

  /** Reads one end of the range. An invalid one changes nothing. */
  private readRange(name: 'from' | 'to'): void {
    const control = input(name);
    const value = Number.isNaN(control.valueAsNumber) ? null : control.valueAsNumber;
    const from = name === 'from' ? value : this.chosen.from;
    const to = name === 'to' ? value : this.chosen.to;
    const isEmpty = from !== null && to !== null && rangeOf(from, to).from === null;
    for (const end of ['from', 'to']) input(end).setCustomValidity('');
    control.setCustomValidity(isEmpty ? 'The range must begin below its end.' : '');
    if (control.reportValidity()) this.set({ [name]: value });
  }

  private set(change: Partial<Look>): void {
    this.chosen = { ...this.chosen, ...change };
    this.reflect();
    this.changed();
  }

  private reflect(): void {
    for (const name of NAMES) input(SWITCHES[name]).checked = this.chosen[name];
    const { colour, map, from, to } = this.chosen;
    select('colour').value = colour;
    select('map').value = map;
    input('from').value = from === null ? '' : String(from);
    input('to').value = to === null ? '' : String(to);
    for (const element of document.querySelectorAll('[data-attribute]')) {
      element.toggleAttribute('hidden', attributeOf(this.chosen) === null);
    }
    input('line-width').valueAsNumber = this.chosen.lineWidth;
  }
}

/** A range of a link. One that does not begin below its end is ignored. */
export function rangeOf(from: number | null, to: number | null): Pick<Look, 'from' | 'to'> {
  return from !== null && to !== null && from >= to ? { from: null, to: null } : { from, to };
}

/** The channels to offer: `known` (of this frame and earlier frames of the track), and the chosen one. */
export function offeredChannels(known: Iterable<string>, chosen: string): string[] {
  const names = [...known];
  return ['plain', 'identity', ...names].includes(chosen) ? names : [...names, chosen];
}

/** `outline,fill,colour:p,from:0,width:2`: switches that are on, and values. */
function lookText(look: Look): string {
  const { colour, map, from, to, lineWidth, hidden, outlineShown } = look;
  return [
    ...NAMES.filter((name) => look[name]), `colour:${colour}`,
    map === DEFAULT_LOOK.map ? '' : `map:${map}`,
    hidden.length > 0 ? `hidden:${hidden.join('.')}` : '', outlineShown > 0 ? `of:${outlineShown}` : '',
    from === null ? '' : `from:${from}`, to === null ? '' : `to:${to}`, `width:${lineWidth}`,
  ].filter(Boolean).join(',');
}
