'use strict';

// Reads the geometry of a frame; the format is told in report_geometry.h.
class GeometryReader {
  constructor(base64) {
    const text = atob(base64);
    this.bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; ++k) this.bytes[k] = text.charCodeAt(k);
    this.view = new DataView(this.bytes.buffer);
    this.next = 0;
    this.x = 0;
    this.y = 0;
  }

  float64() {
    this.next += 8;
    return this.view.getFloat64(this.next - 8, true);
  }

  count() {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = this.bytes[this.next++];
      value |= (byte & 0x7f) << shift;
      if (byte < 0x80) return value >>> 0;
    }
  }

  signed() {
    const value = this.count();
    return (value >>> 1) ^ -(value & 1);
  }

  points(count, into, from) {
    for (let k = from; k < from + count; ++k) {
      into[2 * k] = this.x += this.signed();
      into[2 * k + 1] = this.y += this.signed();
    }
  }
}

// Coordinates stay integers; world = origin + step * integer.
function decodeGeometry(base64) {
  const reader = new GeometryReader(base64);
  const frame = {originX: reader.float64(), originY: reader.float64(), step: reader.float64()};
  const rings = reader.count();
  frame.offsets = [0];
  frame.outerOf = [];
  for (let ring = 0; ring < rings; ++ring) {
    frame.offsets.push(frame.offsets[ring] + reader.count());
    frame.outerOf.push(reader.count() - 1);
  }
  const ringPoints = frame.offsets[rings];
  frame.points = new Int32Array(2 * ringPoints);
  reader.points(ringPoints, frame.points, 0);
  frame.normals = new Float32Array(reader.count());
  for (let k = 0; k < frame.normals.length; ++k) {
    frame.normals[k] = reader.bytes[reader.next++] / 256 * 2 * Math.PI;
  }
  decodeMesh(reader, frame, ringPoints);
  const particles = reader.count();
  frame.particles = new Int32Array(2 * particles);
  reader.points(particles, frame.particles, 0);
  decodeIsolines(reader, frame);
  const colors = reader.count();
  frame.colors = reader.bytes.subarray(reader.next, reader.next + colors);
  return frame;
}

function decodeIsolines(reader, frame) {
  const rings = reader.count();
  const isolines = {offsets: [0], outerOf: new Array(rings)};
  for (let ring = 0; ring < rings; ++ring) isolines.offsets.push(isolines.offsets[ring] + reader.count());
  const points = isolines.offsets[rings];
  isolines.points = new Int32Array(2 * points);
  reader.points(points, isolines.points, 0);
  frame.isolines = {...isolines, originX: frame.originX, originY: frame.originY, step: frame.step};
}

function decodeMesh(reader, frame, ringPoints) {
  const own = reader.count();
  const ownPoints = new Int32Array(2 * own);
  reader.points(own, ownPoints, 0);
  if (reader.count() === 1) {
    frame.meshPoints = new Int32Array(2 * (ringPoints + own));
    frame.meshPoints.set(frame.points);
    frame.meshPoints.set(ownPoints, 2 * ringPoints);
  } else {
    frame.meshPoints = ownPoints;
  }
  const triangles = reader.count();
  frame.triangles = new Uint32Array(3 * triangles);
  frame.interior = new Uint8Array(triangles);
  let a = 0;
  for (let k = 0; k < triangles; ++k) {
    const packed = reader.signed();
    a += packed >> 1;
    frame.interior[k] = packed & 1;
    frame.triangles[3 * k] = a;
    frame.triangles[3 * k + 1] = a + reader.signed();
    frame.triangles[3 * k + 2] = a + reader.signed();
  }
}

// The innermost ring around a point given in the frame's integers, or -1.
function ringAt(frame, x, y) {
  let found = -1;
  let smallest = Infinity;
  for (let ring = 0; ring < frame.outerOf.length; ++ring) {
    const begin = frame.offsets[ring];
    const end = frame.offsets[ring + 1];
    let inside = false;
    let twiceArea = 0;
    for (let k = begin, j = end - 1; k < end; j = k++) {
      const xk = frame.points[2 * k], yk = frame.points[2 * k + 1];
      const xj = frame.points[2 * j], yj = frame.points[2 * j + 1];
      if ((yk > y) !== (yj > y) && x < (xj - xk) * (y - yk) / (yj - yk) + xk) inside = !inside;
      twiceArea += xj * yk - xk * yj;
    }
    if (inside && Math.abs(twiceArea) < smallest) {
      smallest = Math.abs(twiceArea);
      found = ring;
    }
  }
  return found;
}

// Colours tell so many bands of values apart: the map of client/output/color_map.cc.
const COLOR_BANDS = 32;
const COLOR_STOPS = ['3d006f', '282688', '03477c', '115a71', '176a6e', '0e7c67', '1e8e46', '71931f', 'a69313'];

function colorOf(share) {
  const place = Math.max(0, Math.min(1, share)) * (COLOR_STOPS.length - 1);
  const below = Math.min(Math.floor(place), COLOR_STOPS.length - 2);
  const channel = (stop, k) => parseInt(COLOR_STOPS[stop].slice(2 * k, 2 * k + 2), 16);
  const mixed = [0, 1, 2].map((k) => Math.round(
      channel(below, k) + (place - below) * (channel(below + 1, k) - channel(below, k))));
  return `rgb(${mixed.join(' ')})`;
}

const bandOf = (share) => Math.max(0, Math.min(COLOR_BANDS - 1, Math.floor(share * COLOR_BANDS)));

// The part of a convex polygon of [x, y, share] whose shares are above `bound`, for side 1, or
// below, for -1.
function clip(polygon, bound, side) {
  const kept = [];
  polygon.forEach((from, k) => {
    const to = polygon[(k + 1) % polygon.length];
    const isIn = side * (from[2] - bound) >= 0;
    if (isIn) kept.push(from);
    if (isIn === (side * (to[2] - bound) >= 0)) return;
    const part = (bound - from[2]) / (to[2] - from[2]);
    kept.push([from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1]), bound]);
  });
  return kept;
}

// World to picture: the scene is 1000 units wide, y points down.
class Projection {
  constructor(scene) {
    this.left = scene[0];
    this.top = scene[3];
    this.scale = 1000 / (scene[2] - scene[0]);
    this.width = 1000;
    this.height = (scene[3] - scene[1]) * this.scale;
  }

  // Path data of polylines and dots, rounded to 1/100 of a unit.
  x(frame, k) { return Math.round(((frame.originX - this.left) + k * frame.step) * this.scale * 100) / 100; }
  y(frame, k) { return Math.round(((this.top - frame.originY) - k * frame.step) * this.scale * 100) / 100; }

  point(frame, points, k) {
    return this.x(frame, points[2 * k]) + ' ' + this.y(frame, points[2 * k + 1]);
  }

  rings(frame, first = 0, last = frame.outerOf.length) {
    const parts = [];
    for (let ring = first; ring < last; ++ring) {
      for (let k = frame.offsets[ring]; k < frame.offsets[ring + 1]; ++k) {
        parts.push(k === frame.offsets[ring] ? 'M' : 'L', this.point(frame, frame.points, k));
      }
      parts.push('Z');
    }
    return parts.join('');
  }

  triangles(frame, interior) {
    const parts = [];
    const corner = (k) => this.point(frame, frame.meshPoints, frame.triangles[k]);
    for (let k = 0; k < frame.interior.length; ++k) {
      if (frame.interior[k] !== interior) continue;
      parts.push('M', corner(3 * k), 'L', corner(3 * k + 1), 'L', corner(3 * k + 2), 'Z');
    }
    return parts.join('');
  }

  // For each band of colours the path of what lies in it: values are linear in each triangle.
  coloredTriangles(frame, shareOf) {
    const bands = Array.from({length: COLOR_BANDS}, () => []);
    const corner = (k) => {
      const point = frame.triangles[k];
      return [this.x(frame, frame.meshPoints[2 * point]), this.y(frame, frame.meshPoints[2 * point + 1]),
              shareOf(frame.colors[point])];
    };
    for (let k = 0; k < frame.triangles.length; k += 3) {
      let rest = [corner(k), corner(k + 1), corner(k + 2)];
      const shares = rest.map((point) => point[2]);
      const last = bandOf(Math.max(...shares));
      for (let band = bandOf(Math.min(...shares)); band <= last; ++band) {
        const top = (band + 1) / COLOR_BANDS;
        const part = band === last ? rest : clip(rest, top, -1);
        if (part.length >= 3) {
          bands[band].push('M', part.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join('L'), 'Z');
        }
        if (band < last) rest = clip(rest, top, 1);
      }
    }
    return bands.map((parts) => parts.join(''));
  }

  // Each segment of the rings in the colour of its middle.
  coloredRings(frame, shareOf) {
    const bands = Array.from({length: COLOR_BANDS}, () => []);
    for (let ring = 0; ring < frame.outerOf.length; ++ring) {
      const begin = frame.offsets[ring], end = frame.offsets[ring + 1];
      for (let k = begin; k < end; ++k) {
        const next = k + 1 < end ? k + 1 : begin;
        bands[bandOf(shareOf((frame.colors[k] + frame.colors[next]) / 2))].push(
            'M', this.point(frame, frame.points, k), 'L', this.point(frame, frame.points, next));
      }
    }
    return bands.map((parts) => parts.join(''));
  }

  particles(frame) {
    const parts = [];
    for (let k = 0; k < frame.particles.length / 2; ++k) {
      parts.push('M', this.point(frame, frame.particles, k), 'h0');
    }
    return parts.join('');
  }

  normals(frame, length) {
    const parts = [];
    for (let k = 0; k < frame.normals.length; ++k) {
      const dx = Math.round(Math.cos(frame.normals[k]) * length * 100) / 100;
      const dy = Math.round(-Math.sin(frame.normals[k]) * length * 100) / 100;
      parts.push('M', this.point(frame, frame.points, k), 'l', dx, ' ', dy);
    }
    return parts.join('');
  }
}

// What the picture shows at first: all frames, but for those in which the scene has blown up to
// more than three times the median.
function sceneOf(frames) {
  const boxes = frames.map((frame) => frame.box).filter((box) => box);
  if (boxes.length === 0) return [0, 0, 1, 1];
  const side = (box) => Math.max(box[2] - box[0], box[3] - box[1]);
  const sides = boxes.map(side).sort((a, b) => a - b);
  const limit = 3 * sides[Math.floor(sides.length / 2)];
  const kept = boxes.filter((box) => side(box) <= limit || limit === 0);
  const scene = kept.reduce((all, box) => [
    Math.min(all[0], box[0]), Math.min(all[1], box[1]),
    Math.max(all[2], box[2]), Math.max(all[3], box[3])]);
  const margin = 0.04 * side(scene) || 0.5;
  return [scene[0] - margin, scene[1] - margin, scene[2] + margin, scene[3] + margin];
}
