#!/usr/bin/env python3
"""Compares surfaces in space with splashsurf: processor time, triangles and error on the same particles.

Needs the package partiemc (PYTHONPATH) and pysplashsurf (0.14, from PyPI, in a virtual environment
that sees the system's packages). Run on a machine that does nothing else:

    RAYON_NUM_THREADS=1 python3 tests/bench/surface_peers.py --particles 100000,1000000
"""

import argparse
import math
import resource
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import partiemc

try:
    import pysplashsurf
except ImportError:
    sys.exit("surface_peers.py: pysplashsurf is missing; install it from PyPI in a virtual environment")

Points = NDArray[np.float64]

# Lattice of particles: every position is moved by at most this, in spacings.
SHAKE = 0.1


@dataclass(frozen=True)
class Scene:
    """Particles with spacing 1, and the signed distance of points from their true surface."""

    name: str
    positions: Points
    distance: Callable[[Points], NDArray[np.float64]]


@dataclass(frozen=True)
class Method:
    """Reconstructs positions; returns vertices and the number of triangles."""

    name: str
    run: Callable[[Points], tuple[Points, int]]


def lattice(low: Points, high: Points, random: np.random.Generator) -> Points:
    """A shaken lattice with spacing 1 that covers a box."""
    axes = [np.arange(math.floor(a), math.ceil(b) + 1) for a, b in zip(low, high)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return nodes + random.uniform(-SHAKE, SHAKE, nodes.shape)


def ball(count: int, random: np.random.Generator) -> Scene:
    radius = np.cbrt(3 * count / (4 * np.pi))
    reach = np.full(3, radius)
    points = lattice(-reach, reach, random)
    return Scene("ball", points[np.linalg.norm(points, axis=1) < radius],
                 lambda at: np.linalg.norm(at, axis=1) - radius)


def sheet(count: int, random: np.random.Generator) -> Scene:
    """A disc of four layers, whose rim is rounded."""
    radius = math.sqrt(count / (4 * np.pi))
    points = lattice(np.array([-radius, -radius, -2.5]), np.array([radius, radius, 2.5]), random)

    def distance(at: Points) -> NDArray[np.float64]:
        outside = np.maximum(np.hypot(at[:, 0], at[:, 1]) - (radius - 2), 0)
        return np.hypot(outside, at[:, 2]) - 2

    return Scene("sheet", points[distance(points) < 0], distance)


def drops(count: int, random: np.random.Generator) -> Scene:
    """A thousand balls of the same size on a coarse lattice."""
    radius = np.cbrt(3 * count / 1000 / (4 * np.pi))
    pitch = 2 * radius + 8
    one = lattice(np.full(3, -radius - 1), np.full(3, radius + 1), random)
    centres = pitch * np.stack(np.meshgrid(*[np.arange(10)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    parts = []
    for centre in centres:
        moved = one + random.uniform(-0.5, 0.5, 3)
        parts.append(centre + moved[np.linalg.norm(moved, axis=1) < radius])

    def distance(at: Points) -> NDArray[np.float64]:
        within = at - pitch * np.round(at / pitch)
        return np.linalg.norm(within, axis=1) - radius

    return Scene("drops", np.concatenate(parts), distance)


SCENES = {"ball": ball, "sheet": sheet, "drops": drops}


def ours(placement: str, cell_size: float) -> Method:
    sequence = partiemc.Reconstructor(output="surface", placement=placement, spacing=1.0,
                                      cell_size=cell_size, threads=1)

    def run(positions: Points) -> tuple[Points, int]:
        sequence.reset()  # Every run is a first frame.
        surface = sequence.reconstruct(positions).surface
        return surface.points, len(surface.triangles)

    return Method(f"{placement} {cell_size:g}", run)


def splashsurf(cell_size: float, is_smoothed: bool) -> Method:
    """`cell_size` in spacings; the pipeline takes it in particle radii, of which a spacing has two."""
    smoothing = {"mesh_smoothing_iters": 25, "mesh_smoothing_weights": True, "mesh_cleanup": True,
                 "normals_smoothing_iters": 10, "compute_normals": True} if is_smoothed else {}

    def run(positions: Points) -> tuple[Points, int]:
        mesh, _ = pysplashsurf.reconstruction_pipeline(
            positions, particle_radius=0.5, smoothing_length=2.0, cube_size=2 * cell_size,
            iso_surface_threshold=0.6, multi_threading=False, **smoothing)
        surface = mesh.mesh if hasattr(mesh, "mesh") else mesh
        return np.asarray(surface.vertices), len(surface.triangles)

    return Method(f"splashsurf {cell_size:g}{' smoothed' if is_smoothed else ''}", run)


def processor_ms() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return 1000 * (used.ru_utime + used.ru_stime)


def measure(method: Method, scene: Scene, runs: int) -> tuple[float, int, float, float]:
    """Least processor time in ms, triangles; mean and standard deviation of vertices, in spacings.

    The standard deviation leaves out an offset that is the same everywhere.
    """
    least = math.inf
    for _ in range(runs + 1):  # The first run also reserves memory.
        before = processor_ms()
        points, triangles = method.run(scene.positions)
        least = min(least, processor_ms() - before)
    distance = scene.distance(points)
    return least, triangles, float(np.abs(distance).mean()), float(distance.std())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--particles", default="100000", help="numbers of particles (default 100000)")
    parser.add_argument("--scenes", default=",".join(SCENES), help="of ball, sheet, drops (default all)")
    parser.add_argument("--runs", type=int, default=3, help="runs of each method, the least counts (default 3)")
    options = parser.parse_args()
    print("| scene | particles | method | processor time, ms | ratio | triangles | mean deviation, h | its sd |")
    print("|---|---|---|---|---|---|---|---|")
    for count in (int(number) for number in options.particles.split(",")):
        for name in options.scenes.split(","):
            scene = SCENES[name](count, np.random.default_rng(1))
            methods = [ours("virtual-plane", 1.0), ours("marching-squares", 1.0), ours("virtual-plane", 0.5),
                       splashsurf(0.5, True), splashsurf(0.5, False), splashsurf(1.0, True)]
            first = None
            for method in methods:
                ms, triangles, mean, sd = measure(method, scene, options.runs)
                first = first or ms
                print(f"| {scene.name} | {len(scene.positions)} | {method.name} | {ms:.0f} | {ms / first:.1f} "
                      f"| {triangles} | {mean:.4f} | {sd:.4f} |", flush=True)


if __name__ == "__main__":
    main()
