import type { Surface, SurfaceMessage } from '../protocol/surface';
import type { Answer, Job } from './worker';

interface Waiting { resolve(surface: Surface): void; reject(error: Error): void }

/** Decodes surfaces in a worker, which starts with the first surface. All pictures share the worker. */
class Decoder {
  private worker: Worker | null = null;
  private readonly waiting = new Map<number, Waiting>();
  private id = 0;

  /** Rejects with an Error whose message is a sentence if the bytes are wrong or the browser starts no worker. */
  decode(message: SurfaceMessage): Promise<Surface> {
    return new Promise((resolve, reject) => {
      this.worker ??= this.start();
      const job: Job = { id: ++this.id, message };
      this.waiting.set(job.id, { resolve, reject });
      this.worker.postMessage(job);
    });
  }

  private start(): Worker {
    const worker = new Worker(new URL('space_worker.js', document.baseURI), { type: 'module' });
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      const waiting = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if ('surface' in data) waiting?.resolve(data.surface);
      else waiting?.reject(new Error(data.problem));
    };
    worker.onerror = (event) => {
      event.preventDefault();
      this.worker?.terminate();
      this.worker = null;
      for (const { reject } of this.waiting.values()) reject(new Error('The browser cannot start the decoder of surfaces.'));
      this.waiting.clear();
    };
    return worker;
  }
}

export const decoder = new Decoder();
