import type { Picked, Scene } from '../draw';
import { valuesAt } from '../draw/values';
import { toCss } from '../draw/view';
import { channelLabel } from '../protocol/channels';
import type { Frame } from '../protocol/frame';
import { make, select, setText } from './dom';
import { count, number } from './format';
import { Measurement, type MeasureMode, type Point } from './measure';

/** Distance of the readout from the pointer, in CSS pixels. */
const POINTER_GAP = 14;

export interface PointerEvents {
  /** The picture must be drawn again. */
  changed(): void;
  /** The user selected the ring at a world position, or none. */
  selected(point: Point | null): void;
}

/** The pointer on a picture of outlines: the ring under it, the selected ring, the measurement, and the readout of all. */
export class OutlinePointer {
  readonly readout = make('div', { class: 'readout' });
  readonly measurement = new Measurement();
  private place: [number, number] | null = null;
  private picked: Picked | null = null;
  private selected: bigint | null = null;
  /** Whether the readout is of an earlier drawing, and whether the pointer or the selection has changed since then. */
  private isStale = false;
  private isMoved = false;

  /** `shown`: the frame in the picture. */
  constructor(private readonly scene: Scene, private readonly canvas: HTMLCanvasElement,
              private readonly shown: () => Frame | null, private readonly events: PointerEvents) {
    canvas.addEventListener('pointermove', (event) => this.move(event.offsetX, event.offsetY));
    canvas.addEventListener('pointerleave', () => {
      this.place = null;
      this.isMoved = true;
      events.changed();
    });
    canvas.addEventListener('click', (event) => {
      this.move(event.offsetX, event.offsetY);
      this.selectHere();
    });
    canvas.addEventListener('keydown', ({ key }) => this.onKey(key));
  }

  /** The result of the measurement, or empty. */
  get measuredText(): string { return this.measurement.text((identity) => this.areaText(identity)); }

  /** Selects the ring at a world position, or none. */
  selectAt(point: Point | null): void {
    const ring = point && this.scene.pick(...toCss(this.scene.view, this.scene.size, ...point)).ring;
    this.select(ring === null ? null : this.shown()?.rings.identities[ring] ?? null);
  }

  /** Selects the ring of this identity. Null, and 0 for a ring without identity, select nothing. */
  select(identity: bigint | null): void {
    this.selected = identity || null;
    this.scene.select(identity);
    this.isMoved = true;
    this.events.changed();
  }

  /** Marks the ring under the pointer for the next drawing. */
  pick(): void {
    this.picked = this.place && this.shown() ? this.scene.pick(...this.place) : null;
    this.scene.hovered = this.picked?.ring ?? null;
    this.isStale = true;
  }

  /** Writes the readout of the last drawing, if `isDue` or the user has moved the pointer. */
  updateReadout(isDue: boolean): void {
    if (!this.isStale || !(isDue || this.isMoved)) return;
    this.isStale = this.isMoved = false;
    const lines: string[] = [];
    if (this.picked) {
      const { x, y, ring } = this.picked;
      lines.push(`x ${number(x)}, y ${number(y)}`);
      if (ring !== null) lines.push(this.ringText(ring));
      lines.push(...this.valueTexts(x, y));
    }
    if (this.selected !== null) {
      const rings = this.scene.selectedRings;
      lines.push(`Selected: ${rings.length === 0 ? `ring ${this.selected}, not in this frame`
        : rings.map((ring) => this.ringText(ring)).join('\n')}`);
    }
    setText(this.readout, lines.join('\n'));
    this.placeReadout();
  }

  private move(x: number, y: number): void {
    this.place = [x, y];
    this.isMoved = true;
    this.events.changed();
  }

  private onKey(key: string): void {
    if (key === 'Escape') {
      this.measurement.clear();
      this.select(null);
      this.events.selected(null);
    }
    if (key !== 'Enter') return;
    this.move(this.canvas.clientWidth / 2, this.canvas.clientHeight / 2);
    this.selectHere();
  }

  /** Selects or measures at the pointer. */
  private selectHere(): void {
    if (!this.place) return;
    const { x, y, ring } = this.scene.pick(...this.place);
    const identity = ring === null ? null : this.shown()?.rings.identities[ring] ?? null;
    const mode = select('measure').value as MeasureMode;
    if (mode === 'off') {
      this.select(identity);
      this.events.selected(identity === null ? null : [x, y]);
    } else {
      this.measurement.add(mode, [x, y], identity);
      this.events.changed();
    }
  }

  /** Puts the readout beside the pointer, within the picture. Without a pointer it is in the corner. */
  private placeReadout(): void {
    const { style, classList } = this.readout;
    const { width, height } = this.scene.size;
    classList.toggle('at-pointer', this.place !== null);
    if (!this.place) {
      if (style.left !== '') style.left = style.top = '';
      return;
    }
    const { offsetWidth, offsetHeight } = this.readout;
    const [x, y] = this.place;
    const beside = (at: number, length: number, room: number) =>
      (at + POINTER_GAP + length <= room ? at + POINTER_GAP : Math.max(0, at - POINTER_GAP - length));
    style.left = `${Math.min(beside(x, offsetWidth, width), Math.max(0, width - offsetWidth))}px`;
    style.top = `${beside(y, offsetHeight, height)}px`;
  }

  /** Attribute values at a world position. */
  private valueTexts(x: number, y: number): string[] {
    const frame = this.shown();
    if (!frame) return [];
    const names = this.scene.channels;
    const tolerance = Math.max(frame.statistics.spacing, POINTER_GAP / this.scene.view.scale / 2);
    return valuesAt(frame, names, x - frame.origin[0], y - frame.origin[1], tolerance)
      .map(({ name, value }) => `${channelLabel(name, names)} ${number(value)}`);
  }

  /** Area of a measured ring in the frame shown. */
  private areaText(identity: bigint | null): string {
    if (identity === null) return 'no ring here';
    if (identity === 0n) return 'ring without identity';
    const frame = this.shown();
    const ring = frame?.rings.identities.indexOf(identity) ?? -1;
    if (!frame || ring < 0) return `ring ${identity} is not in this frame`;
    const { area, perimeter } = frame.rings;
    return `area ${number(Math.abs(area[ring]))}, perimeter ${number(perimeter[ring])}`;
  }

  private ringText(ring: number): string {
    const rings = this.shown()?.rings;
    if (!rings) return '';
    const identity = rings.identities[ring];
    const kind = rings.area[ring] < 0 ? 'hole' : 'ring';
    const name = identity ? `${kind} ${identity}` : `${kind} without identity`;
    const parents = rings.parents[ring].filter((parent) => parent !== identity);
    return `${name}: area ${number(Math.abs(rings.area[ring]))}, perimeter ` +
      `${number(rings.perimeter[ring])}, particles ${count(rings.particles[ring])}` +
      (parents.length > 0 ? `, from ${rings.parents[ring].join(', ')}` : '');
  }
}
