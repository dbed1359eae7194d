/** Delay until the data is released; the browser has started to read it by then. */
const RELEASE_MS = 60_000;

/** Saves data as a file. */
export function download(name: string, blob: Blob): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), RELEASE_MS);
}
