// ParaView's collections, which list files with their times: .pvd (XML) and .series (JSON).
import { InputError } from './source';
import { attributesOf } from './vtk_xml';

export const isCollectionName = (name: string) => /\.(pvd|series)$/.test(name);

interface Member { file: string; time: number }

/** <DataSet timestep="0.5" part="0" file="frame.vtp"/> */
function membersOfPvd(text: string): Member[] {
  const elements = text.replace(/<!--[\s\S]*?-->/g, '').matchAll(/<DataSet\b((?:"[^"]*"|'[^']*'|[^<>"'])*)>/g);
  return [...elements].map(([, inside]) => {
    const attributes = attributesOf(inside);
    return { file: attributes.get('file') ?? '', time: Number(attributes.get('timestep')?.trim() || NaN) };
  });
}

/** {"file-series-version": "1.0", "files": [{"name": "frame.vtp", "time": 0.5}]} */
function membersOfSeries(text: string, name: string): Member[] {
  try {
    const { files } = JSON.parse(text) as { files: { name?: unknown; time?: unknown }[] };
    return files.map((entry) => ({ file: String(entry.name ?? ''), time: Number(entry.time ?? NaN) }));
  } catch {
    throw new InputError(`${name} is no list of files in JSON. It is truncated or damaged.`);
  }
}

/** The files of a collection in the order of their times, with the rules of client/input/collection.h. Throws InputError. */
export function membersOf(name: string, text: string): Member[] {
  const members = name.toLowerCase().endsWith('.pvd') ? membersOfPvd(text) : membersOfSeries(text, name);
  if (members.length === 0) throw new InputError(`${name} is a collection without files.`);
  for (const { file, time } of members) {
    if (file === '' || !Number.isFinite(time)) {
      throw new InputError(`${name}: an entry must have a file and a time, '${file}' has not.`);
    }
  }
  members.sort((a, b) => a.time - b.time);
  const twice = members.find(({ time }, k) => k > 0 && time === members[k - 1].time);
  if (twice) throw new InputError(`${name} has several files at time ${twice.time}. Parts of a frame are not joined.`);
  return members;
}

/** The members among the opened files, found by their names without folders. Throws InputError. */
export function filesOfMembers(members: readonly Member[], name: string, opened: readonly File[]): File[] {
  return members.map(({ file }) => {
    const found = opened.find((one) => one.name === file.slice(file.lastIndexOf('/') + 1));
    if (!found) throw new InputError(`${name} lists ${file}, which is missing. Open the collection with its files, for example their folder.`);
    return found;
  });
}
