/** What is drawn of a frame, and how. */
export interface Look {
  outline: boolean;
  /** The inside of the outline; by the mesh where there is one, else by the rings alone. */
  fill: boolean;
  /** The edges of the mesh's triangles. */
  edges: boolean;
  particles: boolean;
  normals: boolean;
  /** One colour for all, one for each identity, or the name of an attribute of the vertices. */
  colour: 'plain' | 'identity' | string;
  dark: boolean;
  /** Of the outline, in CSS pixels. */
  lineWidth: number;
}

/** How a scene looks until it is told otherwise. */
export const DEFAULT_LOOK: Readonly<Look> = {
  outline: true,
  fill: true,
  edges: false,
  particles: false,
  normals: false,
  colour: 'plain',
  dark: false,
  lineWidth: 2,
};

/** The attribute that the look colours by; null where it colours by something else. */
export function attributeOf(look: Look): string | null {
  return look.colour === 'plain' || look.colour === 'identity' ? null : look.colour;
}
