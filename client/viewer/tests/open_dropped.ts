import { inspectFiles } from '../src/input/drop';
import { type FileOptions, NO_OPTIONS } from '../src/input/options';
import type { FrameSource } from '../src/input/source';

/** Opens dropped files as frames. Throws InputError. */
export async function openDropped(dropped: File[], options: FileOptions = NO_OPTIONS): Promise<FrameSource> {
  return (await inspectFiles(dropped)).open(options);
}
