// Decodes surfaces in a worker, away from the main thread. Bundled as space_worker.js.
import { CoordinateFormat } from '@proto/v1/reconstruction_pb';
import { MeshoptDecoder } from 'meshoptimizer/decoder';
import { buffersOf, decodeSurface, type Surface, type SurfaceMessage } from '../protocol/surface';

export interface Job { id: number; message: SurfaceMessage }
export type Answer = { id: number; milliseconds: number } & ({ surface: Surface } | { problem: string });

const scope = globalThis as unknown as {
  onmessage: (event: MessageEvent<Job>) => void;
  postMessage(answer: Answer, transfer?: ArrayBuffer[]): void;
};

scope.onmessage = ({ data: { id, message } }) => {
  void decode(id, message);
};

/** Waits for the decoder of compact surfaces. Throws an Error with a sentence if the browser refuses WebAssembly. */
async function start(): Promise<void> {
  try {
    await MeshoptDecoder.ready;
  } catch {
    throw new Error('The browser refuses WebAssembly, which decodes compact surfaces. ' +
      'Start the producer with --coordinates float32.');
  }
}

async function decode(id: number, message: SurfaceMessage): Promise<void> {
  try {
    if (message.format === CoordinateFormat.COMPACT) await start();
    const begin = performance.now();
    const surface = decodeSurface(message, MeshoptDecoder);
    scope.postMessage({ id, milliseconds: performance.now() - begin, surface }, buffersOf(surface));
  } catch (error) {
    scope.postMessage({ id, milliseconds: 0, problem: error instanceof Error ? error.message : String(error) });
  }
}

MeshoptDecoder.ready.catch(() => {});  // `start` reports it.
