import { CanvasCopy, type Drawn } from './canvas_copy';
import type { Mark } from './marks';

/** Formats that browsers record, the best first. */
const FORMATS = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];

/** Bits per pixel and second, enough for thin lines on a plain background. */
const BITS_PER_PIXEL = 6;
const FEWEST_BITS = 2_500_000;

/** Records a scene as a video. */
export interface Clip {
  /** Throws if the browser cannot record WebM, or a recording is running. */
  start(): void;
  /** Returns the video since `start`. */
  stop(): Promise<Blob>;
}

/** `marks`: returns the marks of the current picture; called for every picture. Throws if the scene draws SVG. */
export function clip(scene: Drawn, marks: () => readonly Mark[]): Clip {
  const copy = new CanvasCopy(scene, marks);
  const { canvas } = copy;
  let recorder: MediaRecorder | null = null;
  let parts: Blob[] = [];
  return {
    start() {
      if (recorder) throw new Error('A clip is already being recorded.');
      const format = typeof MediaRecorder === 'undefined'
        ? undefined : FORMATS.find((one) => MediaRecorder.isTypeSupported(one));
      if (!format) throw new Error('This browser cannot record WebM. Save pictures instead.');
      parts = [];
      scene.draw();
      copy.update();
      const begun = new MediaRecorder(canvas.captureStream(), {
        mimeType: format,
        videoBitsPerSecond: Math.max(FEWEST_BITS, BITS_PER_PIXEL * canvas.width * canvas.height),
      });
      begun.ondataavailable = (event) => parts.push(event.data);
      begun.start();
      recorder = begun;
      scene.drawn = () => copy.update();
    },
    stop() {
      const running = recorder;
      recorder = null;
      scene.drawn = null;
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
