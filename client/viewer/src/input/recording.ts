// Recordings (client/recording/recording.h): marks and zstd blocks of length-prefixed messages.
import { fromBinary } from '@bufbuild/protobuf';
import { BinaryReader } from '@bufbuild/protobuf/wire';
import { RecordingHeaderSchema } from '@proto/recording/v1/recording_pb';
import { type ParticleFrame, ParticleFrameSchema, type PeriodicBox } from '@proto/v1/reconstruction_pb';
import { decompress } from 'fzstd';
import { arrayOf } from '../protocol/arrays';
import type { Particles } from '../protocol/particles';
import { particleBytes } from '../protocol/positions';
import type { SectionPlane } from '../protocol/sections';
import { MOST_SCALARS, SCALAR_NAME } from './columns';
import {
  checkSpacing, CHOOSE_SPACE, FieldError, type FileFacts, type FileOptions, NO_OPTIONS, NOT_IN_SPACE, parseSlices, parseSpacing,
} from './options';
import { boxAlong, parsePeriodic, type RecordedBox, withOwnBox } from './periodic';
import { InputError, type FrameSource } from './source';
import { axesOf, hasThreeCoordinates, middlePlane, spacingOf } from './space';

const MARK_BYTES = 24;
const SKIPPABLE_MAGIC = 0x184d2a50;
const FILE_TAG = 'PEMCFILE';

export function isRecording(head: Uint8Array): boolean {
  return head.length >= 16 && new TextDecoder('latin1').decode(head.subarray(8, 16)) === FILE_TAG;
}

/** End of the zstd frame at `at`, from its block sizes (RFC 8878, 3.1.1); null if it is truncated. */
function frameEnd(bytes: Uint8Array, at: number): number | null {
  const descriptor = bytes[at + 4];
  const single = (descriptor >> 5) & 1;
  const sizeFlag = descriptor >> 6;
  const contentSize = sizeFlag === 0 ? single : 1 << sizeFlag;
  const dictionary = [0, 1, 2, 4][descriptor & 3];
  let next = at + 5 + (1 - single) + dictionary + contentSize;
  for (let last = false; !last;) {
    if (next + 3 > bytes.length) return null;
    const header = bytes[next] | (bytes[next + 1] << 8) | (bytes[next + 2] << 16);
    last = (header & 1) === 1;
    const isRun = ((header >> 1) & 3) === 1;
    next += 3 + (isRun ? 1 : header >> 3);
  }
  next += descriptor & 4 ? 4 : 0;
  return next <= bytes.length ? next : null;
}

/** The length-prefixed messages of a block. */
function messagesOf(block: Uint8Array): Uint8Array[] {
  const reader = new BinaryReader(block);
  const messages: Uint8Array[] = [];
  while (reader.pos < block.length) messages.push(reader.bytes());
  return messages;
}

type Scalars = NonNullable<Particles['scalars']>;

/** Attributes with printable names and finite numbers; of equal names the first. Throws InputError for wrong sizes. */
function scalarsOf({ scalars, positions, positionFormat }: ParticleFrame, name: string): Scalars {
  const count = positions.length / particleBytes(positionFormat);
  const all = scalars.map((scalar) => {
    const components = Math.max(scalar.components, 1);
    if (components > 3) throw new InputError(`${name} is damaged: a scalar has more than three components.`);
    const due = 4 * components * count;
    if (scalar.values.length !== due) {
      throw new InputError(`${name} is damaged: a scalar has ${scalar.values.length} bytes where ${due} are due.`);
    }
    return { name: scalar.name, values: scalar.values, components };
  });
  const isFirst = (name: string, k: number) => all.findIndex((scalar) => scalar.name === name) === k;
  return all.filter((scalar, k) => isFirst(scalar.name, k) && SCALAR_NAME.test(scalar.name) && arrayOf(Float32Array, scalar.values).every(Number.isFinite));
}

/** Throws InputError for a damaged box. */
function recordedBox({ box }: ParticleFrame, name: string): RecordedBox | undefined {
  const axes = [box?.x, box?.y, box?.z];
  for (const axis of axes) {
    if (axis && !(axis.length > 0 && Number.isFinite(axis.origin) && Number.isFinite(axis.origin + axis.length))) {
      throw new InputError(`${name} is damaged: a length of the box is not positive and finite.`);
    }
  }
  return box && { axes };
}

/** Location of a frame: a block and a message in it. */
interface Location { block: number; message: number }

/** A recording in memory. Decompresses a block when one of its frames is read. A truncated file ends
 * after its last whole block. */
export class RecordingSource implements FrameSource {
  readonly scalars: string[] = [];
  private readonly locations: Location[] = [];
  private unpacked: { block: number; messages: Uint8Array[] } | null = null;

  notice = '';
  slices: readonly SectionPlane[] = [];
  isSurface = false;
  box?: PeriodicBox;
  periodic: readonly number[] = [];

  private constructor(private readonly bytes: Uint8Array, private readonly blocks: number[],
                      readonly title: string, public spacing: number | null) {}

  /** Throws InputError. */
  static open(bytes: Uint8Array, name: string): RecordingSource {
    if (!isRecording(bytes)) throw new InputError(`${name} is not a recording.`);
    const { blocks, isWhole } = blocksOf(bytes);
    if (blocks.length < 2) throw new InputError(`${name} is truncated in its header. No frame of it is whole.`);
    const [first] = unpack(bytes, blocks, 0, name);
    const header = checked(name, () => fromBinary(RecordingHeaderSchema, first));
    const source = new RecordingSource(bytes, blocks, header.title || name, header.spacing ?? null);
    for (let block = 1; block + 1 < blocks.length; ++block) {
      unpack(bytes, blocks, block, name).forEach((_, message) => source.locations.push({ block, message }));
    }
    if (source.count === 0) throw new InputError(`${name} has no ${isWhole ? '' : 'whole '}frame.`);
    source.scalars.push(...source.commonScalars(name).slice(0, MOST_SCALARS));
    if (!isWhole) source.notice = `${name} is truncated. Its first ${source.count} frames are whole, and later ones are lost.`;
    return source;
  }

  /** Whether the particles have three coordinates, and the defaults of the options. */
  async facts(): Promise<FileFacts> {
    const facts: FileFacts = {
      spacing: this.spacing === null ? '' : String(this.spacing), columns: '', names: [], filters: [], slice: '',
      hasBox: this.read(0).box !== undefined,
    };
    const first = await this.frame(0);
    if (!hasThreeCoordinates(first.positionFormat)) return facts;
    const axes = axesOf(first);
    return { ...facts, slice: middlePlane(axes), spacing: facts.spacing || spacingOf(axes) };
  }

  /** The same frames with options. Throws FieldError. */
  async with(options: FileOptions = NO_OPTIONS): Promise<RecordingSource> {
    const choice = parseSlices(options.slice);
    const isOfSpace = choice.isSurface || choice.slices.length > 0;
    for (const field of ['columns', 'select'] as const) {
      if (options[field] !== '') throw new FieldError(field, 'A recording has no columns. Leave this field empty.');
    }
    const periodic = parsePeriodic(options.periodic, choice.isSurface);
    const spacing = parseSpacing(options.spacing) ?? this.spacing;
    const inSpace = hasThreeCoordinates((await this.frame(0)).positionFormat);
    if (inSpace && !isOfSpace) throw new FieldError('slice', `${this.title} is 3D. ${CHOOSE_SPACE}`);
    if (!inSpace && isOfSpace) throw new FieldError('slice', `${this.title} ${NOT_IN_SPACE}`);
    checkSpacing(choice, spacing);
    const source = Object.assign(Object.create(RecordingSource.prototype) as RecordingSource, this, { spacing, periodic, ...choice });
    source.box = source.frameWithBox(0).box;
    return source;
  }

  get count(): number { return this.locations.length; }

  async frame(index: number): Promise<Particles> { return withOwnBox(this.frameWithBox(index), this.box); }

  private frameWithBox(index: number): Particles {
    const recorded = this.read(index);
    const { time, positionFormat, positions, ids, volumes, velocities } = recorded;
    const name = `${this.title}, frame ${index},`;
    const scalars = scalarsOf(recorded, name).filter((scalar) => this.scalars.includes(scalar.name));
    const frame: Particles = { time, positionFormat, positions, ids, volumes, scalars };
    const box = recordedBox(recorded, name);
    if (this.periodic.length > 0) frame.box = boxAlong(this.periodic, box, name);
    if (arrayOf(Float32Array, velocities).every(Number.isFinite)) frame.velocities = velocities;
    return frame;
  }

  /** Names of the scalars of all frames that have particles: the server refuses a frame without a requested scalar. */
  private commonScalars(name: string): string[] {
    const all: Set<string>[] = [];
    for (let index = 0; index < this.count; ++index) {
      const frame = this.read(index);
      if (frame.positions.length === 0) continue;
      all.push(new Set(scalarsOf(frame, `${name}, frame ${index},`).map((scalar) => scalar.name)));
    }
    return [...all[0] ?? []].filter((one) => all.every((own) => own.has(one)));
  }

  private read(index: number): ParticleFrame {
    const { block, message } = this.locations[index];
    if (this.unpacked?.block !== block) {
      this.unpacked = { block, messages: unpack(this.bytes, this.blocks, block, this.title) };
    }
    const bytes = this.unpacked.messages[message];
    return checked(this.title, () => fromBinary(ParticleFrameSchema, bytes));
  }
}

/** Starts of the whole blocks, and the end of the last one. `isWhole`: whether the closing mark follows them. */
function blocksOf(bytes: Uint8Array): { blocks: number[]; isWhole: boolean } {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const blocks = [MARK_BYTES];
  let at = MARK_BYTES;
  while (at + 8 < bytes.length) {
    if (view.getUint32(at, true) === SKIPPABLE_MAGIC) return { blocks, isWhole: true };
    const end = frameEnd(bytes, at);
    if (end === null) break;
    blocks.push(end);
    at = end;
  }
  return { blocks, isWhole: false };
}

/** The messages of a block. Throws InputError. */
function unpack(bytes: Uint8Array, blocks: number[], block: number, name: string): Uint8Array[] {
  return checked(name, () => messagesOf(decompress(bytes.subarray(blocks[block], blocks[block + 1]))));
}

/** Reads a part of a recording. Throws InputError if it is damaged. */
function checked<T>(name: string, read: () => T): T {
  try {
    return read();
  } catch {
    throw new InputError(`${name} is damaged. The command line can read the frames before the damage.`);
  }
}
