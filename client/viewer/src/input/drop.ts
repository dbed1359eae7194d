import { filesOfMembers, isCollectionName, membersOf } from './collection';
import { CsvReader, parseTimes } from './csv';
import { refusalOf } from './kinds';
import { LammpsReader } from './lammps';
import { sortNaturally } from './natural_order';
import { NpyReader } from './npy';
import { NpzReader } from './npz';
import type { FileFacts, FileOptions } from './options';
import { isRecording, RecordingSource } from './recording';
import { InputError, type FrameSource } from './source';
import { factsOf, ReaderChain, type TableReader, TableSource } from './table_source';
import { blobOf, plainName, textOf } from './text_file';
import { VtkLegacyReader } from './vtk_legacy';
import { VtkXmlReader } from './vtk_xml';
import { isXyz, XyzReader } from './xyz';

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

/** Number of first bytes of a file that determine its kind. */
const HEAD_BYTES = 4096;

async function headOf(file: File): Promise<Uint8Array> {
  return new Uint8Array(await file.slice(0, HEAD_BYTES).arrayBuffer());
}

/** Bytes as text with the same codes. TextDecoder reads "latin1" as Windows-1252. */
const textOfBytes = (bytes: Uint8Array) => String.fromCharCode(...bytes);

const isTimes = (file: File) => plainName(file) === 'times.csv';

/** A file format with tables: how its files are recognised, and their reader. `name` is in lower case, without .gz or .zst; `head` is as in the file. */
interface Kind {
  matches(name: string, head: string): boolean;
  open(file: File): Promise<TableReader> | TableReader;
}

const extensionOf = (name: string) => name.slice(name.lastIndexOf('.') + 1);

/** The kinds in the order in which a folder is searched for them. */
const KINDS: readonly Kind[] = [
  { matches: (_, head) => head.startsWith('\x93NUMPY'), open: async (file) => NpyReader.open(await blobOf(file), file.name) },
  { matches: (_, head) => /^PK(\x03\x04|\x05\x06)/.test(head), open: async (file) => new NpzReader(await blobOf(file), file.name) },
  { matches: (_, head) => head.startsWith('# vtk DataFile'), open: async (file) => new VtkLegacyReader(await blobOf(file), file.name) },
  {
    matches: (name, head) => head.includes('<VTKFile') && !isCollectionName(name),
    open: async (file) => new VtkXmlReader(await blobOf(file), file.name),
  },
  {
    matches: (name, head) => isXyz(head, extensionOf(name)) || (/xyz$/.test(name) && isPacked(head)),
    open: async (file) => XyzReader.open(await textOf(file), file.name),
  },
  { matches: (name, head) => /\.npy$/.test(name) && isPacked(head), open: async (file) => NpyReader.open(await blobOf(file), file.name) },
  {
    matches: (name, head) => /\.(lammpstrj|dump)$|^dump\./.test(name) || head.startsWith('ITEM:'),
    open: async (file) => LammpsReader.open(await blobOf(file), file.name),
  },
  { matches: (name) => /\.(csv|txt|dat|tsv)$/.test(name), open: (file) => new CsvReader(file) },
];

/** Whether a file is compressed by gzip or zstd. */
const isPacked = (head: string) => head.startsWith('\x1f\x8b') || head.startsWith('\x28\xb5\x2f\xfd');

/** Dropped files of one kind, which can be opened with options. */
export interface FileInput {
  /** Name for the user. */
  readonly title: string;
  readonly facts: FileFacts;
  /** Throws InputError, and FieldError for an option. */
  open(options: FileOptions): Promise<FrameSource>;
}

/** Determines the kind and the facts of dropped files. Files of other kinds are ignored. Throws InputError. */
export async function inspectFiles(dropped: File[]): Promise<FileInput> {
  const visible = dropped.filter((file) => !file.name.startsWith('.'));
  const files = sortNaturally(visible, (file) => file.webkitRelativePath || file.name);
  if (files.length === 0) throw new InputError('No readable file was dropped.');
  const first = files[0];
  const firstHead = await headOf(first);
  if (isRecording(firstHead)) {
    const recording = RecordingSource.open(new Uint8Array(await first.arrayBuffer()), first.name);
    return { title: recording.title, facts: await recording.facts(), open: (options) => recording.with(options) };
  }
  const collection = files.find((file) => isCollectionName(plainName(file)));
  if (collection) return inspectCollection(collection, files);
  const tables = files.length > 1 ? files.filter((file) => !isTimes(file)) : files;
  const heads = await Promise.all(tables.map(async (file) => textOfBytes(await headOf(file))));
  for (const kind of KINDS) {
    const own = tables.filter((file, k) => kind.matches(plainName(file), heads[k]));
    if (own.length === 0) continue;
    const readers = await Promise.all(own.map((file) => kind.open(file)));
    const timesFile = files.length > 1 ? files.find(isTimes) : undefined;
    const times = timesFile ? parseTimes(await textOf(timesFile), timesFile.name) : new Map<number, number>();
    const title = own.length === 1 ? own[0].name
      : `${own.length} files, ${own[0].name} to ${own[own.length - 1].name}`;
    return inputOf(title, readers, times);
  }
  throw refused(first, textOfBytes(firstHead));
}

function refused(file: File, text: string): InputError {
  return new InputError(refusalOf(file.name, { text, extension: extensionOf(plainName(file)) }));
}

async function inputOf(title: string, readers: readonly TableReader[], times: Map<number, number>): Promise<FileInput> {
  const reader = new ReaderChain(readers);
  return { title, facts: await factsOf(reader), open: (options) => TableSource.open(title, reader, times, options) };
}

/** The files that a collection lists, with its times. Other opened files are ignored. */
async function inspectCollection(collection: File, opened: readonly File[]): Promise<FileInput> {
  const members = membersOf(collection.name, await textOf(collection));
  const readers: TableReader[] = [];
  for (const file of filesOfMembers(members, collection.name, opened)) {
    const head = textOfBytes(await headOf(file));
    const kind = KINDS.find(({ matches }) => matches(plainName(file), head));
    if (!kind) throw refused(file, head);
    const reader = await kind.open(file);
    if (reader.count !== 1) {
      throw new InputError(`${collection.name} lists ${file.name}, which has ${reader.count} frames. Open it alone.`);
    }
    readers.push(reader);
  }
  return inputOf(collection.name, readers, new Map(members.map(({ time }, k) => [k, time])));
}
