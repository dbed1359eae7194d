import type { Rgb } from '../draw/colours';
import type { Surface } from '../protocol/surface';
import type { Camera, Vector } from './camera';
import type { Clip, CutFace } from './clip';
import type { SpaceLook } from './look';

/** The outlines of a section, or the border of its plane, as lines: pairs of points relative to the surface's origin. */
export interface SectionLines { positions: Float32Array; colour: Rgb; isBorder: boolean }

/** Alpha of a point's tint: the sum of `shell` if its shell is selected, and `body` if its body is (for cut faces). */
export const SELECTED = { shell: 170, body: 85 } as const;

/** Opacities of a translucent surface, of its edges, and of lines that something hides. */
export const TRANSLUCENT = 0.4;
export const TRANSLUCENT_EDGES = 0.35;
export const HIDDEN_LINES = 0.35;
/** Smallest diameter of a particle, and width of a plane's border, in CSS pixels. */
export const SMALLEST_DOT = 1.5;
export const BORDER_WIDTH = 1;

export interface SpaceTheme {
  background: Rgb;
  edge: Rgb;
  particle: Rgb;
  accent: Rgb;
  missing: Rgb;
  /** Light on faces that do not face the light, from 0 to 1. */
  ambient: number;
}

/** Numbers to colour by, one for each point and each particle. Null: points have tints, particles one colour. */
export interface ValueColours {
  points: Float32Array | null;
  particles: Float32Array | null;
  min: number;
  max: number;
  /** 256 colours as RGBA. */
  texels: Uint8Array;
}

/** All that a drawing depends on, except surface, tints and sections. */
export interface SpaceState {
  camera: Camera;
  look: SpaceLook;
  theme: SpaceTheme;
  hasSurface: boolean;
  hasEdges: boolean;
  hasParticles: boolean;
  /** Spacing of the particles in world units. */
  spacing: number;
  lineWidth: number;
  clip: Clip | null;
  /** Null: the picture shows cut bodies from their inside. */
  cutFace: CutFace | null;
  values: ValueColours | null;
  /** Device pixels per CSS pixel. */
  ratio: number;
  /** Distances from the camera between which everything lies. */
  near: number;
  far: number;
  /** World coordinates of the surface's origin. */
  origin: Vector;
}

/** The part of the drawing that the page loads when it shows a surface (renderer.ts). */
export interface SpaceDrawing {
  /** Uploads a surface in place of the former one. Null: only removes the former one. */
  show(surface: Surface | null): void;
  /** RGBA of each point; alpha is a sum of SELECTED. */
  setTints(tints: Uint8Array): void;
  setSections(lines: readonly SectionLines[]): void;
  draw(state: SpaceState): void;
  destroy(): void;
}

/** The content of space.js. */
export interface SpaceModule { createDrawing(canvas: HTMLCanvasElement): SpaceDrawing }

let loading: Promise<SpaceModule> | null = null;

/** Loads space.js once. Throws an Error with a sentence. */
export function loadSpace(): Promise<SpaceModule> {
  const address: string = new URL('space.js', document.baseURI).href;
  loading ??= (import(address) as Promise<SpaceModule>).catch(() => {
    loading = null;
    throw new Error('The part of the page that draws surfaces, space.js, cannot be loaded.');
  });
  return loading;
}
