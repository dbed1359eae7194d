#!/usr/bin/python3
"""Two colliding drops: smoothed particle hydrodynamics in NumPy, streamed during the run.

    partiemc-server &
    client/couplings/numpy_drops.py --every 10 --steps 1500
    client/couplings/numpy_drops.py --dimensions 3 --every 10 --steps 800

An example for your own loop. With Taichi or Warp, `positions` is the return value of
`field.to_numpy()` or `array.numpy()`. One thread sends and receives.
"""

import argparse

import numpy
import partiemc

SPACING = 0.05
LENGTH = 1.3 * SPACING  # Kernel length; the kernel's support is twice as long.
SOUND = 15.0  # Ten times the fastest motion.
VISCOSITY = 0.3
KERNEL = {2: 7 / (4 * numpy.pi), 3: 21 / (16 * numpy.pi)}  # Constant factor of Wendland's kernel.
STEP = 0.001


def drop(centre, radius):
    """Particles on a lattice within a circle or a sphere: (N, len(centre))."""
    line = numpy.arange(-radius, radius, SPACING) + SPACING / 2
    points = numpy.stack(numpy.meshgrid(*[line] * len(centre)), axis=-1).reshape(-1, len(centre))
    return points[numpy.linalg.norm(points, axis=1) < radius] + centre


def neighbours(positions):
    """Pairs that may interact within the next ten steps: two arrays of indices."""
    squared = sum((along[:, None] - along) ** 2 for along in positions.T)
    return numpy.nonzero(numpy.triu(squared < (2.5 * LENGTH) ** 2, 1))


def accelerations(positions, velocities, first, second):
    """Accelerations by pressure and viscosity of the pairs (first, second): (N, dimensions)."""
    count = len(positions)
    apart = positions[first] - positions[second]
    squared = (apart ** 2).sum(axis=1)
    ratio = numpy.sqrt(squared) / LENGTH
    near = numpy.maximum(1 - ratio / 2, 0)
    dimensions = positions.shape[1]
    mass = (SPACING / LENGTH) ** dimensions * KERNEL[dimensions]
    kernel = mass * near ** 4 * (2 * ratio + 1)
    density = (mass + numpy.bincount(first, kernel, count) + numpy.bincount(second, kernel, count))
    pressure = SOUND ** 2 * numpy.maximum(density - 1, 0) / density ** 2
    approach = ((velocities[first] - velocities[second]) * apart).sum(axis=1)
    friction = VISCOSITY * LENGTH * SOUND * approach / (squared + 0.01 * LENGTH ** 2)
    slope = 5 * mass / LENGTH ** 2 * near ** 3  # Derivative of the kernel divided by the distance.
    push = (pressure[first] + pressure[second] - numpy.minimum(friction, 0)) * slope
    return numpy.stack([numpy.bincount(first, push * along, count)
                        - numpy.bincount(second, push * along, count)
                        for along in apart.T], axis=1)


def simulate(steps, dimensions=2):
    """Yields step, time, positions and velocities after every step. The two arrays of shape
    (N, dimensions) are overwritten by the next step."""
    radius = 0.5 if dimensions == 2 else 0.25
    apart = numpy.array([1.2 * radius, -0.3 * radius, 0][:dimensions])
    drops = [drop(-apart, radius), drop(apart, radius)]
    positions = numpy.concatenate(drops)
    forward = numpy.eye(dimensions)[0]
    velocities = numpy.repeat([forward, -forward], [len(one) for one in drops], axis=0)
    for step in range(1, steps + 1):
        if step % 10 == 1:
            pairs = neighbours(positions)
        velocities += STEP * accelerations(positions, velocities, *pairs)
        positions += STEP * velocities
        yield step, step * STEP, positions, velocities


def show(result):
    if len(result.surface):
        print(f"t = {result.time!r}: {len(result.surface)} shells, volume {result.volume!r}, "
              f"{result.surface_digest:016x}", flush=True)
        return
    print(f"t = {result.time!r}: {len(result.rings)} rings, area {result.area!r}, "
          f"{result.rings_digest:016x} {result.mesh_digest:016x}", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--server", help="Server address; default PARTIEMC_SERVER or this machine")
    parser.add_argument("--every", type=int, default=10, help="Steps between frames")
    parser.add_argument("--steps", type=int, default=1500)
    parser.add_argument("--dimensions", type=int, choices=(2, 3), default=2,
                        help="3: surfaces of two balls instead of outlines of two discs")
    options = parser.parse_args()
    output = "surface" if options.dimensions == 3 else "outline"
    with partiemc.connect(options.server, name="drops", spacing=SPACING, output=output,
                          echo_particles=True) as stream:
        for step, time, positions, velocities in simulate(options.steps, options.dimensions):
            if step % options.every == 0:
                stream.send(positions, time, velocities=velocities)
            # Waits only if the window is full.
            while stream.in_flight:
                result = stream.receive(None if stream.in_flight == stream.window else 0)
                if result is None:
                    break
                show(result)
        while stream.in_flight:
            show(stream.receive())


if __name__ == "__main__":
    main()
