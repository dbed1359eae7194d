import type { View } from '../draw';
import { parseSpaceView, type SpaceView, viewText } from '../space/camera';
import { parseSettings, settingsText, type Settings } from '../stream/settings';

/** Content of a pane. Empty `stream`: the stream of the first pane. */
export interface PaneAddress { stream: string; settings: Settings }

/** The state in the page's address. */
export interface Address {
  panes: PaneAddress[];
  /** Name of the file in the panes without a stream, or empty. The user has to open it. */
  file: string;
  /** Options of the file (input/options.ts), or empty. */
  open: string;
  /** Null: the newest frame. */
  frame: number | null;
  view: View | null;
  /** The view of a picture of surfaces. */
  camera: SpaceView | null;
  look: string;
  /** The look of surfaces (space/look.ts). */
  space: string;
}

/** `#file=dam.csv` or `#stream=dam&frame=12&view=1,2,300&set=placement:qef&beside=~fill:none&look=...` */
export function addressText(address: Address): string {
  const parts: string[] = [];
  const add = (name: string, value: string) => {
    if (value) parts.push(`${name}=${escaped(value)}`);
  };
  const [first, ...others] = address.panes;
  add('stream', first?.stream ?? '');
  add('file', address.file);
  add('open', address.open);
  add('frame', address.frame === null ? '' : String(address.frame));
  const view = address.view;
  add('view', view ? [view.x, view.y, view.scale].map((v) => Number(v.toPrecision(6))).join(',') : '');
  add('camera', address.camera ? viewText(address.camera) : '');
  add('set', first ? settingsText(first.settings) : '');
  for (const pane of others) add('beside', `${pane.stream}~${settingsText(pane.settings)}`);
  add('look', address.look);
  add('space', address.space);
  return parts.length > 0 ? `#${parts.join('&')}` : '';
}

/** Percent-encodes all but commas, colons and semicolons, so that the address stays readable. */
function escaped(value: string): string {
  return encodeURIComponent(value).replace(/%(2C|3A|3B)/g, decodeURIComponent);
}

function parseView(text: string | null): View | null {
  const [x, y, scale] = (text ?? '').split(',').map(Number);
  return [x, y, scale].every(Number.isFinite) && scale > 0 ? { x, y, scale } : null;
}

/** The inverse of addressText. Ignores unknown parts. */
export function parseAddress(hash: string): Address {
  const values = new URLSearchParams(hash.replace(/^#/, ''));
  const frame = Number(values.get('frame') || NaN);
  const stream = values.get('stream') ?? '';
  const file = stream ? '' : values.get('file') ?? '';
  const first = stream || file ? [{ stream, settings: parseSettings(values.get('set') ?? '') }] : [];
  const others = values.getAll('beside').map((text) => {
    const at = text.indexOf('~');
    return { stream: text.slice(0, at), settings: parseSettings(text.slice(at + 1)) };
  });
  return {
    file,
    open: file ? values.get('open') ?? '' : '',
    panes: [...first, ...first.length > 0 ? others : []],
    frame: Number.isInteger(frame) ? frame : null,
    view: parseView(values.get('view')),
    camera: parseSpaceView(values.get('camera')),
    look: values.get('look') ?? '',
    space: values.get('space') ?? '',
  };
}
