import { Placement } from '@proto/v1/reconstruction_pb';
import {
  AS_STREAMED, FILLS, nameOf, parseWalls, PLACEMENTS, SHARES, SIZES, wallsText, type Settings,
} from '../stream/settings';
import { block, byId, button, input, select, setText } from './dom';

const NUMBERS = {
  kernelRadius: 'kernel', referenceRadius: 'reference', cellSize: 'cell', surfaceOffset: 'offset',
} as const;
/** Cells across the outline in the paper's comparisons. */
const GRIDS = [32, 64];
const OF_OUTLINES = 'A stream of surfaces is shown with the settings of its producer.';
type NumberName = keyof typeof NUMBERS;

/** Settings of the chosen pane. */
export class SettingsPanel {
  /** The last valid settings. */
  private valid: Settings = AS_STREAMED;
  private isBlocked = false;

  /** `cellSize`: for a number of cells across the outline; null without an outline. */
  constructor(private readonly changed: (settings: Settings) => void,
              private readonly cellSize: (cells: number) => number | null) {
    for (const name of Object.keys(PLACEMENTS)) select('placement').add(new Option(name, name));
    for (const name of Object.keys(FILLS)) select('fill').add(new Option(name, name));
    for (const name of Object.keys(SIZES)) select('sizes').add(new Option(name, name));
    for (const share of SHARES) select('share').add(new Option(`${share} %`, String(share)));
    const form = byId('settings', HTMLFormElement);
    form.addEventListener('submit', (event) => event.preventDefault());
    form.addEventListener('change', () => this.read());
    for (const cells of GRIDS) button(`grid-${cells}`).addEventListener('click', () => this.setGrid(cells));
    button('reset-settings').addEventListener('click', () => {
      this.show(AS_STREAMED, '');
      this.changed({ ...AS_STREAMED });
    });
  }

  show(settings: Settings, pane: string): void {
    this.valid = settings;
    select('placement').value = nameOf(PLACEMENTS, settings.placement);
    select('fill').value = nameOf(FILLS, settings.fill);
    select('sizes').value = settings.sizes ?? '';
    input('walls').value = wallsText(settings.walls);
    input('walls').setCustomValidity('');
    for (const name of Object.keys(NUMBERS) as NumberName[]) {
      input(NUMBERS[name]).value = settings[name] === null ? '' : String(settings[name]);
    }
    select('share').value = String(settings.share);
    setText(byId('settings-of', HTMLElement), pane);
    this.offerOffset();
  }

  /** Disables the controls for surfaces, which keep the settings of their stream. */
  offer(hasSurfaces: boolean): void {
    if (hasSurfaces === this.isBlocked) return;
    this.isBlocked = hasSurfaces;
    const controls = [
      select('placement'), select('fill'), select('sizes'), input('walls'), select('share'), ...Object.values(NUMBERS).map(input),
      ...GRIDS.map((cells) => button(`grid-${cells}`)), button('reset-settings'),
    ];
    for (const control of controls) block(control, hasSurfaces ? OF_OUTLINES : '');
    if (!hasSurfaces) this.offerOffset();
  }

  private setGrid(cells: number): void {
    const size = this.cellSize(cells);
    if (size === null) return;
    input('cell').value = String(size);
    this.read();
  }

  private read(): void {
    this.offerOffset();
    const walls = this.readWalls();
    // If a field is invalid, its last valid value is used. The browser shows the limits of the field.
    byId('settings', HTMLFormElement).reportValidity();
    const numberIn = (name: NumberName) => {
      const { validity, valueAsNumber } = input(NUMBERS[name]);
      if (!validity.valid) return this.valid[name];
      return Number.isNaN(valueAsNumber) ? null : valueAsNumber;
    };
    this.valid = {
      placement: PLACEMENTS[select('placement').value] ?? 0,
      fill: FILLS[select('fill').value] ?? 0,
      sizes: select('sizes').value || null,
      walls,
      kernelRadius: numberIn('kernelRadius'),
      referenceRadius: numberIn('referenceRadius'),
      cellSize: numberIn('cellSize'),
      surfaceOffset: numberIn('surfaceOffset'),
      share: Number(select('share').value),
    };
    this.changed({ ...this.valid });
  }

  /** The walls of the field, or the last valid ones. Marks an invalid field. */
  private readWalls(): number[][] | null {
    const field = input('walls');
    field.setCustomValidity('');
    try {
      return parseWalls(field.value);
    } catch (error) {
      field.setCustomValidity((error as Error).message);
      return this.valid.walls;
    }
  }

  /** The surface offset applies to one placement only. */
  private offerOffset(): void {
    if (this.isBlocked) return;
    input('offset').disabled = PLACEMENTS[select('placement').value] !== Placement.FARTHEST_PARTICLE;
  }
}
