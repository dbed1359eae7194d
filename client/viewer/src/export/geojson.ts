import { type Frame, NO_RING, type Rings } from '../protocol/frame';

/**
 * The frame as GeoJSON: a polygon for each outer ring with its holes, outer rings
 * counter-clockwise, in float64 world coordinates. Properties as in `partiemc replay`: area and
 * perimeter of the whole polygon, particles, ring, identity, parents, frame, time. Identities
 * are integers of 64 bits; some readers keep only 53.
 */
export function geojson(frame: Frame): string {
  const { rings, sequence, time } = frame;
  const holes: number[][] = Array.from(rings.outerOf, () => []);
  rings.outerOf.forEach((outer, ring) => {
    if (outer !== NO_RING) holes[outer].push(ring);
  });
  const features: string[] = [];
  holes.forEach((own, ring) => {
    if (rings.outerOf[ring] === NO_RING) features.push(feature(frame, ring, own));
  });
  return `{"type":"FeatureCollection","frame":${sequence},"time":${number(time)},"features":[\n` +
    `${features.join(',\n')}\n]}\n`;
}

function feature(frame: Frame, outer: number, holes: readonly number[]): string {
  const { rings } = frame;
  const all = [outer, ...holes];
  const sum = (measure: Float64Array): number =>
    all.reduce((total, ring) => total + measure[ring], 0);
  const properties = [
    `"area":${number(sum(rings.area))}`,
    `"perimeter":${number(sum(rings.perimeter))}`,
    `"particles":${number(rings.particles[outer])}`,
    `"ring":${outer}`,
    `"identity":${rings.identities[outer]}`,
    `"parents":[${rings.parents[outer].join(',')}]`,
    `"frame":${frame.sequence}`,
    `"time":${number(frame.time)}`,
  ];
  const coordinates = all.map((ring) => closed(rings, ring, frame.origin));
  return `{"type":"Feature","properties":{${properties.join(',')}},` +
    `"geometry":{"type":"Polygon","coordinates":[${coordinates.join(',')}]}}`;
}

/** The coordinates of a ring, with the first vertex repeated at the end. */
function closed(rings: Rings, ring: number, origin: readonly [number, number]): string {
  const points: string[] = [];
  for (let k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
    const x = origin[0] + rings.points[2 * k];
    const y = origin[1] + rings.points[2 * k + 1];
    points.push(`[${number(x)},${number(y)}]`);
  }
  if (points.length > 0) points.push(points[0]);
  return `[${points.join(',')}]`;
}

/** A number in JSON; null unless finite. */
function number(value: number): string {
  return Number.isFinite(value) ? String(value) : 'null';
}
