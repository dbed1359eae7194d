/** Parts of a frame to draw, and their style. */
export interface Look {
  outline: boolean;
  /** The inside of the outline: the mesh, or the rings of a frame without a mesh. */
  fill: boolean;
  /** The edges of the mesh's triangles. */
  edges: boolean;
  particles: boolean;
  normals: boolean;
  isolines: boolean;
  /** One colour for all, one for each identity, or the name of an attribute. */
  colour: 'plain' | 'identity' | string;
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
  isolines: true,
  colour: 'plain',
  dark: false,
  lineWidth: 2,
};

/** The attribute that the look colours by, or null. */
export function attributeOf(look: Look): string | null {
  return look.colour === 'plain' || look.colour === 'identity' ? null : look.colour;
}
