// Draws the surfaces of a report. Bundled as client/output/report_space.txt, which a report with surfaces holds.
import { create, fromBinary } from '@bufbuild/protobuf';
import { PositionFormat, ReconstructedFrameSchema } from '@proto/v1/reconstruction_pb';
// It uses no WebAssembly, which the report's Content-Security-Policy refuses.
import { MeshoptDecoder } from '../../node_modules/meshoptimizer/meshopt_decoder_reference.js';
import { bytesOf } from '../protocol/arrays';
import { decodeSpaceFrame } from '../protocol/decode';
import type { Frame } from '../protocol/frame';
import { decodeSurface } from '../protocol/surface';
import { type SpaceEvents, SpacePicture } from '../space/picture';
import { createDrawing } from '../space/renderer';
import { bytesOfBase64, Reader } from './reader';

/** The functions that the report's main script calls. */
export interface SpacePart {
  frameOf(base64: string): Frame;
  pictureOf(events: SpaceEvents): SpacePicture;
}

/** Decodes a frame in the format of client/output/report_surface.h. An empty text is a frame without a surface. */
export function frameOf(base64: string): Frame {
  if (base64 === '') return decodeSpaceFrame(create(ReconstructedFrameSchema));
  const reader = new Reader(bytesOfBase64(base64));
  const frame = decodeSpaceFrame(fromBinary(ReconstructedFrameSchema, reader.byteArray()));
  const origin = [reader.float64(), reader.float64(), reader.float64()];
  const step = reader.float64();
  const at = [0, 0, 0];
  const places = Float64Array.from({ length: 3 * reader.count() }, (_, k) => {
    at[k % 3] += reader.signed();
    return origin[k % 3] + step * at[k % 3];
  });
  if (frame.surface) {
    frame.surface.particleFormat = PositionFormat.FLOAT64_3;
    frame.surface.particles = bytesOf(places);
  }
  return frame;
}

const part: SpacePart = {
  frameOf,
  pictureOf: (events) => new SpacePicture(events, {
    load: async () => ({ createDrawing }),
    decode: async (message) => decodeSurface(message, MeshoptDecoder),
  }, true),
};
Object.assign(globalThis, { partiemcSpacePart: part });
