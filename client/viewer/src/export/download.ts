/** The browser has begun to read the data by then, milliseconds. */
const READ_BY = 60_000;

/** Has the browser save the data as a file of this name. */
export function download(name: string, blob: Blob): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), READ_BY);
}
