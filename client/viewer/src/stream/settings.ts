import { create } from '@bufbuild/protobuf';
import {
  Boundary, CoordinateFormat, Fill, Output, OutputsSchema, Placement, ReconstructionParametersSchema,
  SectionSchema, Sizes, SlicePlaneSchema, WallSchema, type ReconstructionParameters,
} from '@proto/v1/reconstruction_pb';
import { LEAST_LENGTH, MOST_OF_WALLS, parseDecimal } from '../input/number_text';
import type { FrameSource } from '../input/source';
import type { Method } from './track';

/** Settings of a reconstruction. Null and UNSPECIFIED: the value of the stream. Lengths in spacings. */
export interface Settings {
  placement: Placement;
  fill: Fill;
  /** A name of SIZES. */
  sizes: string | null;
  /** Points x0, y0, x1, y1, ... of each wall, in world units. */
  walls: number[][] | null;
  kernelRadius: number | null;
  referenceRadius: number | null;
  cellSize: number | null;
  surfaceOffset: number | null;
  /** Share of particles to use, in percent. */
  share: number;
}

export const AS_STREAMED: Readonly<Settings> = {
  placement: Placement.UNSPECIFIED, fill: Fill.UNSPECIFIED, sizes: null, walls: null, kernelRadius: null,
  referenceRadius: null, cellSize: null, surfaceOffset: null, share: 100,
};

export const SHARES = [100, 80, 50, 30];

/** Limits of the cell size, in spacings. */
const CELL_SIZES = [0.25, 4] as const;

/** The cell size, in spacings, with which `cells` cells span a length, limited to CELL_SIZES. */
export function cellSizeOf(cells: number, length: number, spacing: number): number {
  const size = Number((length / cells / spacing).toPrecision(4));
  return Math.min(CELL_SIZES[1], Math.max(CELL_SIZES[0], size));
}

export const PLACEMENTS: Record<string, Placement> = {
  'marching-squares': Placement.MARCHING_SQUARES,
  qef: Placement.QEF,
  'farthest-particle': Placement.FARTHEST_PARTICLE,
  'virtual-plane': Placement.VIRTUAL_PLANE,
};

export const FILLS: Record<string, Fill> = {
  none: Fill.NONE,
  grid: Fill.GRID,
  greedy: Fill.GREEDY,
  conforming: Fill.CONFORMING,
  polygon: Fill.POLYGON,
};

/** Sizes of the particles, and the kind of boundary (Boundary in core/include/partiemc/parameters.h). */
export const SIZES: Record<string, { sizes: Sizes; boundary: Boundary }> = {
  equal: { sizes: Sizes.EQUAL, boundary: Boundary.BULK },
  own: { sizes: Sizes.OWN, boundary: Boundary.BULK },
  grains: { sizes: Sizes.OWN, boundary: Boundary.GRAINS },
};

/** Walls as text: the coordinates of a wall have commas between them, walls have spaces. */
export function wallsText(walls: readonly number[][] | null): string {
  return walls?.map((points) => points.join(',')).join(' ') ?? '';
}

/** The inverse of wallsText; null without walls. Throws if a wall has fewer than two points or a wrong coordinate. */
export function parseWalls(text: string): number[][] | null {
  const walls = text.split(/\s+/).filter((wall) => wall !== '').map((wall) => wall.split(',').map(parseDecimal));
  if (walls.some((points) => points.length < 4 || points.length % 2 !== 0 || !points.every(isOfWalls))) {
    throw new Error('Each wall must have two points or more: 0,0,1,0 is the line through (0, 0) and (1, 0).');
  }
  return walls.length > 0 ? walls : null;
}

/** Name of a placement or fill on the command line. */
export function nameOf(names: Record<string, number>, value: number): string {
  return Object.keys(names).find((name) => names[name] === value) ?? '';
}

export function isAsStreamed(settings: Settings): boolean {
  return settingsText(settings) === '';
}

/** Settings in the page's address: `placement:qef;fill:none`. */
export function settingsText(settings: Settings): string {
  const parts: [string, string | number | null][] = [
    ['placement', nameOf(PLACEMENTS, settings.placement)],
    ['fill', nameOf(FILLS, settings.fill)],
    ['sizes', settings.sizes],
    ['walls', wallsText(settings.walls).replaceAll(' ', '/')],
    ['kernel', settings.kernelRadius],
    ['reference', settings.referenceRadius],
    ['cell', settings.cellSize],
    ['offset', settings.surfaceOffset],
    ['share', settings.share === 100 ? null : settings.share],
  ];
  return parts.filter(([, value]) => value !== null && value !== '')
    .map(([name, value]) => `${name}:${value}`).join(';');
}

function numberOf(text: string | undefined): number | null {
  const value = parseDecimal(text ?? '');
  return Number.isNaN(value) ? null : value;
}

/** Whether a point of a wall may have this coordinate. NaN: no. */
function isOfWalls(value: number): boolean {
  const magnitude = Math.abs(value);
  return magnitude === 0 || (magnitude >= LEAST_LENGTH && magnitude <= MOST_OF_WALLS);
}

/** Settings for the user: `placement qef, fill none`. */
export function settingsPhrase(settings: Settings): string {
  return settingsText(settings).replaceAll(';', ', ').replaceAll(':', ' ') || 'as streamed';
}

function wallsIn(address: string): number[][] | null {
  try {
    return parseWalls(address.replaceAll('/', ' '));
  } catch {
    return null;
  }
}

/** The inverse of settingsText. Ignores unknown names and values. */
export function parseSettings(text: string): Settings {
  const values = new Map(text.split(';').map((part) => {
    const at = part.indexOf(':');
    return [part.slice(0, at), part.slice(at + 1)] as const;
  }));
  const share = numberOf(values.get('share'));
  const sizes = values.get('sizes');
  return {
    placement: PLACEMENTS[values.get('placement') ?? ''] ?? Placement.UNSPECIFIED,
    fill: FILLS[values.get('fill') ?? ''] ?? Fill.UNSPECIFIED,
    sizes: sizes !== undefined && sizes in SIZES ? sizes : null,
    walls: wallsIn(values.get('walls') ?? ''),
    kernelRadius: numberOf(values.get('kernel')),
    referenceRadius: numberOf(values.get('reference')),
    cellSize: numberOf(values.get('cell')),
    surfaceOffset: numberOf(values.get('offset')),
    share: share !== null && SHARES.includes(share) ? share : 100,
  };
}

/** Placement and fill of the parameters. */
export function methodOf(parameters: ReconstructionParameters | null): Method | null {
  return parameters && {
    placement: nameOf(PLACEMENTS, parameters.placement), fill: nameOf(FILLS, parameters.fill),
  };
}

/** The method with the choices of the settings. */
export function methodWith(method: Method | null, { placement, fill }: Settings): Method | null {
  return method && {
    placement: nameOf(PLACEMENTS, placement) || method.placement, fill: nameOf(FILLS, fill) || method.fill,
  };
}

/**
 * Sets the box, the output and the planes of a source in `parameters`, and returns them. For surfaces, all planes are
 * sections. Otherwise the first plane is the plane of the outline, and the others are sections.
 */
export function withSource(parameters: ReconstructionParameters, { isSurface, slices, box }: FrameSource) {
  parameters.box = box;
  const planes = slices.map(({ origin, normal }) => create(SlicePlaneSchema, {
    originX: origin[0], originY: origin[1], originZ: origin[2],
    normalX: normal[0], normalY: normal[1], normalZ: normal[2],
  }));
  if (isSurface) parameters.output = Output.SURFACE;
  else parameters.slice = planes.shift();
  parameters.sections.push(...planes.map((slice) => create(SectionSchema, { slice })));
  return parameters;
}

/** Parameters of a stream or frame: `base`, overridden by the settings. `spacing`: for a `base` without
 * one, in world units; null: the server estimates it. */
export function parametersOf(settings: Settings, base: ReconstructionParameters | null,
                             spacing: number | null): ReconstructionParameters {
  const placement = settings.placement || (base?.placement ?? Placement.UNSPECIFIED);
  const sameField = (settings.placement === 0 || settings.placement === base?.placement) &&
    settings.kernelRadius === null;
  const sizes = settings.sizes === null ? undefined : SIZES[settings.sizes];
  const walls = settings.walls?.map((points) => create(WallSchema, { points })) ?? base?.walls;
  const farthest = placement === Placement.FARTHEST_PARTICLE;
  const canHaveWalls = placement === Placement.VIRTUAL_PLANE || placement === Placement.UNSPECIFIED;
  return create(ReconstructionParametersSchema, {
    placement,
    fill: settings.fill || (base?.fill ?? Fill.UNSPECIFIED),
    spacing: base?.spacing ?? (spacing || undefined),
    spacingRule: base?.spacingRule,
    sizes: sizes?.sizes ?? base?.sizes,
    boundary: sizes?.boundary ?? base?.boundary,
    noiseFilter: base?.noiseFilter,
    kernelRadius: settings.kernelRadius ?? base?.kernelRadius,
    cellSize: settings.cellSize ?? base?.cellSize,
    // A reference radius is calibrated for one placement and one kernel. With another placement or
    // kernel it is not set, and the server calibrates it.
    referenceRadius: settings.referenceRadius ?? (sameField ? base?.referenceRadius : undefined),
    clean: sameField ? base?.clean : undefined,
    surfaceOffset: farthest ? settings.surfaceOffset ?? base?.surfaceOffset : undefined,
    normalMemory: base?.normalMemory,
    attributeTolerance: base?.attributeTolerance,
    plane: base?.plane,
    slice: base?.slice,
    isovalue: base?.isovalue,
    sections: base?.sections,
    minComponentArea: base?.minComponentArea,
    minComponentParticles: base?.minComponentParticles,
    output: base?.output,
    surface: base?.surface,
    // Other placements cannot be cut at walls.
    walls: canHaveWalls ? walls : undefined,
    wallPhases: canHaveWalls ? base?.wallPhases : undefined,
    wallPlanes: base?.wallPlanes,
    phaseAttribute: base?.phaseAttribute,
    // Farthest-particle cannot be wrapped.
    box: base?.box && { ...base.box, wraps: base.box.wraps && !farthest },
  });
}

/** Outputs of everything that the page draws. `isSurface`: of surfaces. */
export function outputsFor(attributes: string[], isSurface = false) {
  return create(OutputsSchema, {
    rings: true, mesh: true, surface: isSurface, normals: true, attributes,
    coordinateFormat: isSurface ? CoordinateFormat.COMPACT : CoordinateFormat.FLOAT32_RELATIVE,
  });
}
