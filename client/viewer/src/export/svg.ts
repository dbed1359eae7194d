import { hex, mix, type Rgb, theme, unpacked } from '../draw/colours';
import { attributeOf, type Look, shownIsolines } from '../draw/look';
import { type Mark, marksSvg } from './marks';
import { pieceTints } from '../draw/pieces';
import { type Range, rampColour, rangeOf, shareOf } from '../draw/ramp';
import { fillTones, isolineColour, ringColours } from '../draw/look_colours';
import {
  BAND_TINT, dotDiameter, EDGE_ALPHA, EDGE_TINT, EDGE_WIDTH, INTERIOR_TINT, ISOLINE_WIDTH,
  NORMAL_WIDTH, normalLength, normalStride, ownDot, ownDotDiameter, PARTICLE_ALPHA,
} from '../draw/style';
import type { Size, View } from '../draw/view';
import { type Frame, type Mesh, NO_RING, type Rings, TRIANGLE_CLASS } from '../protocol/frame';
import {
  bandPaths, dotPath, edgePaths, normalPath, outlinePath, Projection, ringPath, segmentPaths, short, trianglePaths,
} from './paths';

/** Number of different colours of an attribute. */
const RAMP_STEPS = 64;

/**
 * The frame as an SVG picture, in CSS pixels. `range`: of the attribute that the look colours by;
 * null: the frame's own. `selected`: rings to highlight. `marks`: caption, scale and legend.
 */
export function svg(
  frame: Frame, look: Look, view: View, size: Size, range: Range | null = null,
  selected: readonly number[] = [], marks: readonly Mark[] = [],
): string {
  const at = new Projection(view, size, frame.origin);
  const colours = theme(look.dark);
  const parts = [
    `<svg xmlns="http://www.w3.org/2000/svg" width="${short(size.width)}" ` +
      `height="${short(size.height)}" viewBox="0 0 ${short(size.width)} ${short(size.height)}">`,
    `<title>Frame ${frame.sequence}, time ${frame.time}</title>`,
    '<g stroke-linecap="round" stroke-linejoin="round">',
    `<rect width="100%" height="100%" fill="${hex(colours.background)}"/>`,
  ];
  const { rings, mesh, statistics } = frame;
  const ringColour = ringColours(rings, look);
  if (look.fill) parts.push(...areas(frame, look, ringColour, range, at));
  if (look.edges && mesh) parts.push(...edges(mesh, rings, look, ringColour, at));
  if (look.particles && frame.particles) {
    parts.push(...dots(frame, frame.particles, look, range, view.scale, at));
  }
  if (look.normals && rings.normals) {
    const count = rings.points.length / 2;
    const length = normalLength(statistics.spacing * view.scale);
    const stride = normalStride((statistics.perimeter * view.scale) / Math.max(count, 1), count);
    parts.push(line(normalPath(rings.points, rings.normals, stride, length, at),
      colours.normal, NORMAL_WIDTH));
  }
  if (look.outline) parts.push(...outline(rings, look, ringColour, range, at));
  for (const isoline of shownIsolines(frame, look)) {
    const path = outlinePath(isoline.rings, isoline.rings.outerOf.keys(), new Projection(view, size, isoline.origin));
    parts.push(line(path, isolineColour(isoline.index, look.dark), ISOLINE_WIDTH));
  }
  parts.push(line(outlinePath(rings, selected, at), colours.accent, Math.max(look.lineWidth, 1) + 0.5));
  const drawn = parts.filter((part) => part !== '');
  return [...drawn, '</g>', ...marksSvg(marks), '</svg>', ''].join('\n');
}

/**
 * The inside of the outline in the colour of the band, and on it the merged triangles, one path for each
 * colour, so that no seams appear. If the mesh has the look's attribute: the mesh in its colours.
 */
function areas(
  frame: Frame, look: Look, ringColour: (ring: number) => number, range: Range | null,
  at: Projection,
): string[] {
  const { rings, mesh } = frame;
  const name = attributeOf(look);
  const values = name === null ? undefined : mesh?.attribute(name);
  if (mesh && values) return colouredMesh(mesh, values, look, range, at);
  const { background } = theme(look.dark);
  const { band, interior } = fillTones(look);
  const tinted = look.colour === 'identity';
  const groups = grouped(rings, (ring) => {
    const outer = rings.outerOf[ring];
    return tinted ? ringColour(outer === NO_RING ? ring : outer) : 0;
  });
  const inTone = (colour: number, plain: Rgb, share: number): Rgb =>
    tinted ? mix(background, unpacked(colour), share) : plain;
  const parts = Array.from(groups, ([colour, group]) =>
    area(ringPath(rings, group, at), inTone(colour, band, BAND_TINT)));
  if (!mesh) return parts;
  const tints = tinted ? pieceTints(mesh, rings, ringColour) : null;
  const merged = trianglePaths(mesh, (triangle) => {
    if (mesh.classes[triangle] !== TRIANGLE_CLASS.interior) return null;
    return tints ? tints[mesh.triangles[3 * triangle]] : 0;
  }, at);
  for (const [colour, path] of merged) {
    parts.push(area(path, inTone(colour, interior, INTERIOR_TINT)));
  }
  return parts;
}

/** The mesh in the colours of an attribute. A stroke of the same colour hides the seams. */
function colouredMesh(
  mesh: Mesh, values: Float32Array, look: Look, range: Range | null, at: Projection,
): string[] {
  const extent = range ?? rangeOf(values) ?? { min: 0, max: 1 };
  const paths = bandPaths(mesh, (point) => shareOf(extent, values[point]), RAMP_STEPS, at);
  return paths.map((path, band) => {
    const colour = hex(rampColour((band + 0.5) / RAMP_STEPS, look));
    return path && `<path fill="${colour}" stroke="${colour}" stroke-width="0.7" d="${path}"/>`;
  });
}

function edges(
  mesh: Mesh, rings: Rings, look: Look, ringColour: (ring: number) => number, at: Projection,
): string[] {
  const { background, edge } = theme(look.dark);
  const tints = look.colour === 'identity' ? pieceTints(mesh, rings, ringColour) : null;
  const paths = edgePaths(mesh, (point) => (tints ? tints[point] : 0), at);
  return Array.from(paths, ([colour, path]) =>
    line(path, tints ? mix(background, unpacked(colour), EDGE_TINT) : edge,
      EDGE_WIDTH, EDGE_ALPHA));
}

function outline(
  rings: Rings, look: Look, ringColour: (ring: number) => number, range: Range | null,
  at: Projection,
): string[] {
  const name = attributeOf(look);
  const values = name === null ? undefined : rings.attributes.get(name);
  if (!values) {
    return Array.from(grouped(rings, ringColour), ([colour, group]) =>
      line(outlinePath(rings, group, at), unpacked(colour), look.lineWidth));
  }
  const extent = range ?? rangeOf(values) ?? { min: 0, max: 1 };
  const colourOf = (point: number, next: number): string =>
    colourAt(extent, (values[point] + values[next]) / 2, look);
  return Array.from(segmentPaths(rings, colourOf, at), ([colour, path]) =>
    stroke(path, colour, look.lineWidth, 1));
}

/** Widths of dots with own sizes are rounded to this, in CSS pixels, so that many share a path. */
const DOT_STEP = 0.05;

/** The particles, in one colour or in the colours of an attribute, in groups of one diameter. */
function dots(
  { particleAttributes, particleSizes: own, statistics }: Frame, particles: Float32Array, look: Look, range: Range | null,
  scale: number, at: Projection,
): string[] {
  const name = attributeOf(look);
  const values = name === null ? undefined : particleAttributes?.get(name);
  const { share, alpha } = own ? ownDot(own.areDiscs) : { share: 0, alpha: PARTICLE_ALPHA };
  const diameterOf = (k: number) => own
    ? DOT_STEP * Math.round(ownDotDiameter(share * own.diameters[k] * scale) / DOT_STEP)
    : dotDiameter(statistics.spacing * scale);
  const groups = groupBy(particles.length / 2, diameterOf);
  return Array.from(groups).flatMap(([diameter, members]) => {
    const path = (chosen: readonly number[]) => chosen.map((k) => dotPath(particles.subarray(2 * k, 2 * k + 2), at)).join('');
    if (!values) return [line(path(members), theme(look.dark).particle, diameter, alpha)];
    const extent = range ?? rangeOf(values) ?? { min: 0, max: 1 };
    const byColour = groupBy(members.length, (k) => colourAt(extent, values[members[k]], look));
    const rim = line(path(members), theme(look.dark).background, diameter, alpha);
    const dot = diameter > 4 ? diameter - 1.5 : diameter;
    return [rim, ...Array.from(byColour, ([colour, chosen]) =>
      stroke(path(chosen.map((k) => members[k])), colour, dot, alpha))];
  });
}

/** The numbers below `count`, by a key. */
function groupBy<Key>(count: number, keyOf: (k: number) => Key): Map<Key, number[]> {
  const groups = new Map<Key, number[]>();
  for (let k = 0; k < count; ++k) {
    const key = keyOf(k);
    const group = groups.get(key);
    if (group) group.push(k);
    else groups.set(key, [k]);
  }
  return groups;
}

/** Colour of a number, in steps. */
function colourAt(extent: Range, value: number, look: Look): string {
  const share = shareOf(extent, value);
  if (!Number.isFinite(share)) return hex(theme(look.dark).missing);
  return hex(rampColour(Math.round(share * RAMP_STEPS) / RAMP_STEPS, look));
}

function grouped(rings: Rings, colourOf: (ring: number) => number): Map<number, number[]> {
  const groups = new Map<number, number[]>();
  for (let ring = 0; ring < rings.outerOf.length; ++ring) {
    const colour = colourOf(ring);
    const group = groups.get(colour);
    if (group) group.push(ring);
    else groups.set(colour, [ring]);
  }
  return groups;
}

function area(path: string, colour: Rgb): string {
  return path && `<path fill="${hex(colour)}" fill-rule="evenodd" d="${path}"/>`;
}

function line(path: string, colour: Rgb, width: number, opacity = 1): string {
  return stroke(path, hex(colour), width, opacity);
}

function stroke(path: string, colour: string, width: number, opacity: number): string {
  const thin = opacity < 1 ? ` stroke-opacity="${opacity}"` : '';
  return path &&
    `<path fill="none" stroke="${colour}" stroke-width="${short(width)}"${thin} d="${path}"/>`;
}
