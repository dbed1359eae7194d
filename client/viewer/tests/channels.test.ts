import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import { Boundary, PositionFormat, ReconstructedFrameSchema, Sizes } from '@proto/v1/reconstruction_pb';
import { bytesOf } from '../src/protocol/arrays';
import { AttributeChannels, channelLabel } from '../src/protocol/channels';
import { decodeFrame } from '../src/protocol/decode';
import { particleChannels } from '../src/protocol/particles';

const velocity = { name: 'velocity', components: 2, values: bytesOf(Float32Array.of(3, 4, 0, -2)) };
const pressure = { name: 'p', components: 1, values: bytesOf(Float32Array.of(7, 8)) };
const numbers = (values: Float32Array | undefined) => [...values ?? []];

test('a vector has a magnitude and components, a scalar itself', () => {
  const channels = new AttributeChannels([velocity, pressure]);
  assert.deepEqual(channels.keys(), ['velocity', 'velocity x', 'velocity y', 'p']);
  assert.deepEqual(numbers(channels.get('velocity')), [5, 2]);
  assert.deepEqual(numbers(channels.get('velocity x')), [3, 0]);
  assert.deepEqual(numbers(channels.get('velocity y')), [4, -2]);
  assert.deepEqual(numbers(channels.get('p')), [7, 8]);
  assert.equal(channels.get('velocity z'), undefined);
  assert.equal(channels.get('velocity'), channels.get('velocity'), 'decoded once');
});

test('the legend names the magnitude', () => {
  const names = new AttributeChannels([velocity, pressure]).keys();
  assert.deepEqual(names.map((name) => channelLabel(name, names)),
                   ['velocity, magnitude', 'velocity x', 'velocity y', 'p']);
});

test('outline, mesh and particles of a message have the same channels', () => {
  const inSpace = bytesOf(Float32Array.of(1, 2, 2, 0, 0, -3));
  const frame = decodeFrame(create(ReconstructedFrameSchema, {
    rings: { attributes: [velocity] },
    mesh: { attributes: [velocity] },
    particleFormat: PositionFormat.FLOAT32_3,
    particles: bytesOf(new Float32Array(6)),
    particleVelocities: inSpace,
    particleScalars: [{ name: 'type', values: bytesOf(Float32Array.of(1, 2)) }],
  }), 0);
  assert.deepEqual(numbers(frame.rings.attributes.get('velocity y')), [4, -2]);
  assert.deepEqual(numbers(frame.mesh?.attribute('velocity y')), [4, -2]);
  assert.deepEqual(numbers(frame.particleAttributes?.get('velocity')), [3, 3]);
  assert.deepEqual(numbers(frame.particleAttributes?.get('velocity z')), [2, -3]);
  assert.deepEqual(numbers(frame.particleAttributes?.get('type')), [1, 2]);
});

test('particles of a stream with own sizes have diameters', () => {
  const message = create(ReconstructedFrameSchema, {
    particleFormat: PositionFormat.FLOAT64_2,
    particles: bytesOf(new Float64Array(4)),
    particleVolumes: bytesOf(Float32Array.of(4, 9)),
  });
  const sizesOf = (sizes: Sizes, boundary: Boundary) => decodeFrame(message, 0, { sizes, boundary }).particleSizes;
  assert.deepEqual(sizesOf(Sizes.OWN, Boundary.UNSPECIFIED), { diameters: Float32Array.of(2, 3), areDiscs: false });
  assert.equal(sizesOf(Sizes.OWN, Boundary.GRAINS)?.areDiscs, true);
  assert.equal(sizesOf(Sizes.EQUAL, Boundary.UNSPECIFIED), null);
  assert.equal(decodeFrame(message, 0).particleSizes, null);
});

test('particles of a file have their scalars and velocity', () => {
  const channels = particleChannels({
    time: 0, positionFormat: PositionFormat.FLOAT64_2, positions: new Uint8Array(32),
    velocities: velocity.values, scalars: [pressure],
  });
  assert.deepEqual([...channels.keys()], ['p', 'velocity', 'velocity x', 'velocity y']);
  assert.deepEqual(numbers(channels.get('velocity')), [5, 2]);
});
