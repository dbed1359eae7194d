import { create, type MessageInitShape, toBinary } from '@bufbuild/protobuf';
import { BinaryWriter } from '@bufbuild/protobuf/wire';
import { RecordingHeaderSchema } from '@proto/recording/v1/recording_pb';
import { ParticleFrameSchema } from '@proto/v1/reconstruction_pb';
import { inspectFiles } from '../src/input/drop';
import { type FileOptions, NO_OPTIONS } from '../src/input/options';
import type { FrameSource } from '../src/input/source';

/** Opens dropped files as frames. Throws InputError. */
export async function openDropped(dropped: File[], options: FileOptions = NO_OPTIONS): Promise<FrameSource> {
  return (await inspectFiles(dropped)).open(options);
}

/** A recording of one block with these frames, whose zstd frames store their bytes raw. */
export function recordingOf(...frames: MessageInitShape<typeof ParticleFrameSchema>[]): File {
  const mark = (tag: string) => [0x50, 0x2a, 0x4d, 0x18, 16, 0, 0, 0, ...Buffer.from(tag), ...new Uint8Array(8)];
  const block = (...messages: Uint8Array[]) => {
    const writer = new BinaryWriter();
    for (const message of messages) writer.bytes(message);
    const bytes = writer.finish();
    const size = new Uint8Array(Uint32Array.of(bytes.length).buffer);
    const header = bytes.length << 3 | 1;
    return [0x28, 0xb5, 0x2f, 0xfd, 0xa0, ...size, header & 255, header >> 8 & 255, header >> 16, ...bytes];
  };
  return new File([Uint8Array.from([
    ...mark('PEMCFILE'), ...block(toBinary(RecordingHeaderSchema, create(RecordingHeaderSchema, { title: 'made' }))),
    ...block(...frames.map((frame) => toBinary(ParticleFrameSchema, create(ParticleFrameSchema, frame)))), ...mark('PEMCTAIL'),
  ])], 'made.pemc');
}
