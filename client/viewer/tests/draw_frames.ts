import { bytesOf } from '../src/protocol/arrays';
import { type Frame, type Mesh, NO_RING } from '../src/protocol/frame';

/** Frames to draw: outlines of a level set on a grid, with a mesh like the server's. */

/** Negative inside. */
export type LevelSet = (x: number, y: number) => number;

/** A body with a round hole, and drops: some outside, one in the hole. */
export function blobs(phase: number): LevelSet {
  const drops = [
    { x: 13.2, y: 8.2, r: 1.3 }, { x: 15.4, y: 5.6, r: 0.55 }, { x: 14.6, y: 3.1, r: 0.9 },
    { x: 2.1, y: 9.3, r: 0.7 }, { x: 6.1, y: 5.3, r: 0.55 },
  ];
  return (x, y) => {
    const angle = Math.atan2(y - 5, x - 7);
    const wave = 0.35 * Math.sin(5 * angle + phase) + 0.2 * Math.sin(9 * angle - 2 * phase);
    const body = Math.hypot(x - 7, (y - 5) * 1.2) - 4.2 - wave;
    const hole = 1.5 + 0.15 * Math.sin(3 * angle + phase) - Math.hypot(x - 6.1, y - 5.3);
    let value = Math.max(body, hole);
    for (const drop of drops) {
      value = Math.min(value, Math.hypot(x - drop.x, y - drop.y) - drop.r);
    }
    return value;
  };
}

export interface FrameOptions {
  level?: LevelSet;
  width?: number;
  height?: number;
  cell?: number;
  /** Merges the whole cells of a row to rectangles. Default true. False: each whole cell has two triangles. */
  merge?: boolean;
  sequence?: bigint;
  origin?: [number, number];
}

export function makeFrame(options: FrameOptions = {}): Frame {
  const { level = blobs(0.4), width = 17, height = 11, cell = 0.25, merge = true } = options;
  const columns = Math.round(width / cell);
  const rows = Math.round(height / cell);
  const stride = columns + 1;
  const values = new Float64Array(stride * (rows + 1));
  for (let row = 0; row <= rows; ++row) {
    for (let column = 0; column <= columns; ++column) {
      values[row * stride + column] = level(column * cell, row * cell) || 1e-9;
    }
  }
  const inside = (node: number): boolean => values[node] < 0;

  // Segments of marching squares lead from one edge of a cell to another, with the inside on the left.
  // The number of an edge is twice its lower node, plus 1 if the edge is vertical.
  const following = new Map<number, number>();
  const corners = (node: number): number[] => [node, node + 1, node + stride + 1, node + stride];
  const edgesOf = (node: number): number[] =>
    [2 * node, 2 * (node + 1) + 1, 2 * (node + stride), 2 * node + 1];
  const cutCells: number[] = [];
  for (let row = 0; row < rows; ++row) {
    for (let column = 0; column < columns; ++column) {
      const node = row * stride + column;
      const signs = corners(node).map(inside);
      const edges = edgesOf(node);
      let cut = false;
      for (let k = 0; k < 4; ++k) {
        if (!signs[k] || signs[(k + 1) % 4]) continue;  // The inside ends on edge k.
        let back = k;
        while (signs[back]) back = (back + 3) % 4;  // Its first edge.
        following.set(edges[k], edges[back]);
        cut = true;
      }
      if (cut) cutCells.push(node);
    }
  }

  const points: number[] = [];
  const pointOf = new Map<number, number>();  // By edge; nodes as -1 - node.
  const place = (key: number): number => {
    const known = pointOf.get(key);
    if (known !== undefined) return known;
    const node = key >= 0 ? key >> 1 : -1 - key;
    const other = key < 0 ? node : key & 1 ? node + stride : node + 1;
    const share = key < 0 ? 0 : values[node] / (values[node] - values[other]);
    points.push(
      cell * ((node % stride) + share * ((other % stride) - (node % stride))),
      cell * (Math.floor(node / stride) +
        share * (Math.floor(other / stride) - Math.floor(node / stride))));
    pointOf.set(key, points.length / 2 - 1);
    return points.length / 2 - 1;
  };

  const offsets = [0];
  for (const begin of following.keys()) {
    if (pointOf.has(begin)) continue;
    for (let edge = begin; !pointOf.has(edge); edge = following.get(edge) ?? begin) place(edge);
    offsets.push(points.length / 2);
  }
  const ringPoints = points.length;

  const triangles: number[] = [];
  const classes: number[] = [];
  const polygon = (keys: number[], kind: number): void => {
    const corner = keys.map(place);
    for (let k = 1; k + 1 < corner.length; ++k) {
      triangles.push(corner[0], corner[k], corner[k + 1]);
      classes.push(kind);
    }
  };
  for (const node of cutCells) {
    const nodes = corners(node);
    const edges = edgesOf(node);
    const keys: number[] = [];
    for (let k = 0; k < 4; ++k) {
      if (inside(nodes[k])) keys.push(-1 - nodes[k]);
      if (inside(nodes[k]) !== inside(nodes[(k + 1) % 4])) keys.push(edges[k]);
    }
    polygon(keys, 0);
  }
  const whole = (row: number, column: number): boolean =>
    corners(row * stride + column).every(inside);
  for (let row = 0; row < rows; ++row) {
    for (let column = 0; column < columns; ++column) {
      if (!whole(row, column)) continue;
      let end = column + 1;
      while (merge && end < columns && whole(row, end)) ++end;
      const [left, right] = [row * stride + column, row * stride + end];
      polygon([left, right, right + stride, left + stride].map((node) => -1 - node), 1);
      column = end - 1;
    }
  }
  return frameOf(options, points, offsets, ringPoints, triangles, classes, level, cell);
}

/** A mesh of arrays. */
export function meshOf(
  points: Float32Array, triangles: Uint32Array, classes: Uint8Array,
  attributes: ReadonlyMap<string, Float32Array> = new Map(),
): Mesh {
  const bytes = { points: bytesOf(points), triangles: bytesOf(triangles) };
  return { points, triangles, classes, bytes, attribute: (name) => attributes.get(name) };
}

function frameOf(
  options: FrameOptions, points: number[], offsets: number[], ringPoints: number,
  triangles: number[], classes: number[], level: LevelSet, cell: number,
): Frame {
  const count = offsets.length - 1;
  const area = new Float64Array(count);
  const perimeter = new Float64Array(count);
  const normals = new Float32Array(ringPoints);
  const speed = new Float32Array(ringPoints / 2);
  for (let ring = 0; ring < count; ++ring) {
    for (let k = offsets[ring]; k < offsets[ring + 1]; ++k) {
      const next = k + 1 < offsets[ring + 1] ? k + 1 : offsets[ring];
      const [ax, ay] = [points[2 * k], points[2 * k + 1]];
      const [bx, by] = [points[2 * next], points[2 * next + 1]];
      area[ring] += (ax * by - bx * ay) / 2;
      perimeter[ring] += Math.hypot(bx - ax, by - ay);
      const step = 1e-4;
      const gx = level(ax + step, ay) - level(ax - step, ay);
      const gy = level(ax, ay + step) - level(ax, ay - step);
      normals.set([gx / Math.hypot(gx, gy), gy / Math.hypot(gx, gy)], 2 * k);
      speed[k] = 2 + Math.sin(ax) + 0.2 * ay;
    }
  }
  const outers = [...area.keys()].filter((ring) => area[ring] > 0);
  const outerOf = Uint32Array.from(area, (one, ring) => {
    if (one > 0) return NO_RING;
    // Every hole lies in the largest body.
    const larger = (most: number, outer: number): number =>
      area[outer] > area[most] ? outer : most;
    return outers.reduce(larger, outers[0] ?? ring);
  });
  const particles: number[] = [];
  const spacing = 1.05 * cell;
  for (let y = spacing / 2; y < (options.height ?? 11); y += spacing) {
    for (let x = spacing / 2; x < (options.width ?? 17); x += spacing) {
      const px = x + 0.2 * cell * Math.sin(37 * x + 11 * y);
      const py = y + 0.2 * cell * Math.cos(23 * x - 7 * y);
      if (level(px, py) < -0.4 * spacing) particles.push(px, py);
    }
  }
  const sum = (numbers: Float64Array): number => numbers.reduce((total, one) => total + one, 0);
  return {
    sequence: options.sequence ?? 1n,
    time: 0,
    origin: options.origin ?? [0, 0],
    rings: {
      points: Float32Array.from(points.slice(0, ringPoints)),
      offsets: Uint32Array.from(offsets),
      outerOf,
      identities: BigUint64Array.from({ length: count }, (_, ring) => BigInt(ring + 1)),
      area,
      perimeter,
      particles: Float64Array.from(area, (one) => Math.max(0, Math.round(one / spacing ** 2))),
      parents: Array.from({ length: count }, (_, ring) => [BigInt(ring + 1)]),
      cuts: new Uint32Array(0),
      wetted: new Uint32Array(0), contacts: new Uint32Array(0), contactAngles: new Float32Array(0),
      normals,
      attributes: new Map([['speed', speed]]),
    },
    sections: [],
    isolines: [],
    mesh: meshOf(
      Float32Array.from(points), Uint32Array.from(triangles), Uint8Array.from(classes)),
    particles: Float32Array.from(particles),
    particleAttributes: null,
    statistics: {
      particles: particles.length / 2, triangles: classes.length, trianglesGrid: classes.length,
      area: sum(area), perimeter: sum(perimeter), spacing, milliseconds: 0, droppedHoles: 0,
      droppedComponents: 0, droppedSpray: 0, selfIntersections: 0, foldedTriangles: 0, doubts: [],
    },
    ringsDigest: 0n,
    meshDigest: 0n,
  };
}
