// Periodic boxes of files, with the rules of `partiemc replay --periodic`.
import { create } from '@bufbuild/protobuf';
import { type PeriodicBox, PeriodicBoxSchema } from '@proto/v1/reconstruction_pb';
import type { Particles } from '../protocol/particles';
import { FieldError } from './options';

const AXES = ['x', 'y', 'z'] as const;

/** Bounds of a box along an axis, world units. */
interface Bounds { origin: number; length: number }

/** The box of a simulation as an input states it. */
export interface RecordedBox {
  /** By axis; undefined for an axis without a periodic boundary. */
  axes: (Bounds | undefined)[];
  /** Triclinic: `axes` does not describe its faces. */
  isTilted?: boolean;
}

/** Parses the periodic axes `x,y`; empty: none. Throws FieldError. */
export function parsePeriodic(text: string, isSurface: boolean): number[] {
  const names = text.trim() === '' ? [] : text.split(',').map((name) => name.trim());
  const axes = names.map((name) => AXES.slice(0, isSurface ? 3 : 2).findIndex((axis) => axis === name));
  if (axes.includes(-1)) throw new FieldError('periodic', 'Write the periodic axes, for example x,y. The axis z requires a surface.');
  return axes;
}

/**
 * The box of a frame along the periodic axes of its stream. Throws FieldError without a box, for a triclinic box, and
 * for a box that is not periodic along one of the axes.
 */
export function boxAlong(axes: readonly number[], box: RecordedBox | undefined, name: string): PeriodicBox {
  const refuse = (fault: string) => new FieldError('periodic', `${name} ${fault}`);
  if (!box) throw refuse('has no box. Leave the periodic axes empty.');
  if (box.isTilted) throw refuse('has a triclinic box. Periodic axes require an orthogonal box.');
  return create(PeriodicBoxSchema, Object.fromEntries(axes.map((axis) => {
    const bounds = box.axes[axis];
    if (!bounds) throw refuse(`has no periodic boundary along ${AXES[axis]}.`);
    return [AXES[axis], bounds];
  })));
}

/** The frame without `box` if this equals the box of its stream, otherwise the frame itself. */
export function withOwnBox(frame: Particles, ofStream: PeriodicBox | undefined): Particles {
  const isSame = frame.box && AXES.every((axis) => {
    const [own, other] = [frame.box?.[axis], ofStream?.[axis]];
    return own?.origin === other?.origin && own?.length === other?.length;
  });
  return isSame ? { ...frame, box: undefined } : frame;
}
