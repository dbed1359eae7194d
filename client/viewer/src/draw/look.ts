import type { Frame, Isoline } from '../protocol/frame';
import type { MapName } from './ramp';

/** Parts of a frame to draw, and their style. */
export interface Look {
  outline: boolean;
  /** The inside of the outline: the mesh, or the rings of a frame without a mesh. */
  fill: boolean;
  /** The edges of the mesh's triangles. */
  edges: boolean;
  particles: boolean;
  normals: boolean;
  /** Sections and isolines, as lines. */
  sections: boolean;
  /** Coordinates along the edges of the picture. */
  axes: boolean;
  /** Outlines without a line: 0 is the stream's own, k is section k - 1. */
  hidden: readonly number[];
  /** The outline to show as the picture, numbered as in `hidden`. */
  outlineShown: number;
  /** One colour for all, one for each identity, or a channel of an attribute (protocol/channels.ts). */
  colour: 'plain' | 'identity' | string;
  /** Colours of an attribute. */
  map: MapName;
  /** Numbers with the first and the last colour of the map. Null: smallest and largest of all frames so far. */
  from: number | null;
  to: number | null;
  dark: boolean;
  /** Width of the outline, in CSS pixels. */
  lineWidth: number;
}

export const DEFAULT_LOOK: Readonly<Look> = {
  outline: true,
  fill: true,
  edges: false,
  particles: false,
  normals: false,
  sections: true,
  axes: false,
  hidden: [],
  outlineShown: 0,
  colour: 'plain',
  map: 'violet-yellow',
  from: null,
  to: null,
  dark: false,
  lineWidth: 2,
};

/** The isolines that the look draws. */
export function shownIsolines(frame: Frame, look: Look): Isoline[] {
  return look.sections ? frame.isolines.filter(({ index }) => !look.hidden.includes(index)) : [];
}

/** The attribute that the look colours by, or null. */
export function attributeOf(look: Look): string | null {
  return look.colour === 'plain' || look.colour === 'identity' ? null : look.colour;
}
