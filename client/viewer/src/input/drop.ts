import { CsvSource } from './csv';
import { LammpsSource } from './lammps';
import { naturalOrder } from './natural_order';
import { isRecording, RecordingSource } from './recording';
import { InputError, type FrameSource } from './source';
import { plainName, textOf } from './text_file';

/** Files of a dropped entry, including folders. */
async function filesOfEntry(entry: FileSystemEntry): Promise<File[]> {
  if (entry.isFile) {
    return [await new Promise<File>((resolve, reject) => {
      (entry as FileSystemFileEntry).file(resolve, reject);
    })];
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  const files: File[] = [];
  while (true) {  // A reader returns at most 100 entries per call.
    const entries = await new Promise<FileSystemEntry[]>((resolve, reject) => {
      reader.readEntries(resolve, reject);
    });
    if (entries.length === 0) return files;
    for (const inner of entries) files.push(...await filesOfEntry(inner));
  }
}

/** All dropped files. Call during the event. */
export async function filesOfDrop(transfer: DataTransfer): Promise<File[]> {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry())
    .filter((entry): entry is FileSystemEntry => entry !== null);
  if (entries.length === 0) return [...transfer.files];
  return (await Promise.all(entries.map(filesOfEntry))).flat();
}

async function headOf(file: File): Promise<Uint8Array> {
  return new Uint8Array(await file.slice(0, 32).arrayBuffer());
}

const isTable = (file: File) => /\.(csv|txt|dat|tsv)$/.test(plainName(file));
const isDump = (file: File) => /\.(lammpstrj|dump)$|^dump\./.test(plainName(file));
const isTimes = (file: File) => plainName(file) === 'times.csv';

/** Opens dropped files as frames. Throws InputError. */
export async function openDropped(dropped: File[]): Promise<FrameSource> {
  const files = dropped.filter((file) => !file.name.startsWith('.'))
    .sort((a, b) => naturalOrder(a.webkitRelativePath || a.name, b.webkitRelativePath || b.name));
  if (files.length === 0) throw new InputError('No readable file was dropped.');
  const first = files[0];
  if (isRecording(await headOf(first))) {
    return RecordingSource.open(new Uint8Array(await first.arrayBuffer()), first.name);
  }
  const dump = files.find(isDump) ?? (await isDumpInside(first) ? first : undefined);
  if (dump) {
    const packed = dump.name !== dump.name.replace(/\.(gz|zst)$/, '');
    return LammpsSource.open(packed ? new Blob([await textOf(dump)]) : dump, dump.name);
  }
  const tables = files.filter((file) => isTable(file) && !isTimes(file));
  if (tables.length > 0) {
    const title = tables.length === 1 ? tables[0].name
      : `${tables.length} files, ${tables[0].name} to ${tables[tables.length - 1].name}`;
    return CsvSource.open(tables, files.find(isTimes) ?? null, title);
  }
  throw new InputError(`${first.name} cannot be read here. Drop CSV files or their folder, a LAMMPS text ` +
                       'dump or a recording (.pemc). `partiemc convert` makes recordings of VTK and NPY files.');
}

async function isDumpInside(file: File): Promise<boolean> {
  return new TextDecoder('latin1').decode(await headOf(file)).startsWith('ITEM:');
}
