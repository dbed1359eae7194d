/** What a browser may be able to record, the best first. */
const FORMATS = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];

/** Enough for thin lines on an even ground, in bits per pixel and second. */
const BITS_PER_PIXEL = 6;
const FEWEST_BITS = 2_500_000;

/** A recording of a canvas, as a film of what is drawn on it. */
export interface Clip {
  /** Throws where the browser records no WebM, or where it records already. */
  start(): void;
  /** The film since `start`. */
  stop(): Promise<Blob>;
}

export function clip(canvas: HTMLCanvasElement): Clip {
  let recorder: MediaRecorder | null = null;
  let parts: Blob[] = [];
  return {
    start() {
      if (recorder) throw new Error('A clip is being recorded already.');
      const format = typeof MediaRecorder === 'undefined'
        ? undefined : FORMATS.find((one) => MediaRecorder.isTypeSupported(one));
      if (!format) throw new Error('This browser records no WebM. Save pictures instead.');
      parts = [];
      recorder = new MediaRecorder(canvas.captureStream(), {
        mimeType: format,
        videoBitsPerSecond: Math.max(FEWEST_BITS, BITS_PER_PIXEL * canvas.width * canvas.height),
      });
      recorder.ondataavailable = (event) => parts.push(event.data);
      recorder.start();
    },
    stop() {
      const running = recorder;
      recorder = null;
      if (!running) return Promise.reject(new Error('No clip is being recorded.'));
      return new Promise((resolve, reject) => {
        running.onstop = () => resolve(new Blob(parts, { type: 'video/webm' }));
        running.onerror = () => reject(new Error('The browser could not record the clip.'));
        running.stop();
        for (const track of running.stream.getTracks()) track.stop();
      });
    },
  };
}
