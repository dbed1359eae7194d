#!/usr/bin/env python3
"""Compares surfaces in space with peers: processor time, triangles and error on the same particles.

Needs the package partiemc (PYTHONPATH). A peer that is missing is named, and its rows are left out:
  splashsurf 0.14  pysplashsurf from PyPI, in a virtual environment that sees the system's packages
  VTK              apt-get install python3-vtk9
  OpenVDB          apt-get install libopenvdb-dev libtbb-dev, then
      g++ -std=c++20 -O3 -march=native tests/bench/openvdb_peer.cc -lopenvdb -ltbb -o build/openvdb_peer
Run on a machine that does nothing else:

    RAYON_NUM_THREADS=1 python3 tests/bench/surface_peers.py --particles 100000,1000000
"""

import argparse
import math
import pathlib
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import partiemc

Points = NDArray[np.float64]
Triangles = NDArray[np.int64]

# Lattice of particles: every position is moved by at most this, in spacings.
SHAKE = 0.1


@dataclass(frozen=True)
class Scene:
    """Particles with spacing 1, and the signed distance of points from their true surface."""

    name: str
    positions: Points
    distance: Callable[[Points], NDArray[np.float64]]


@dataclass(frozen=True)
class Outcome:
    """Least processor time in ms, vertices, and triangles as three indices each."""

    ms: float
    points: Points
    triangles: Triangles


@dataclass(frozen=True)
class Method:
    """Reconstructs positions a number of times, always from nothing."""

    name: str
    run: Callable[[Points, int], Outcome]


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


def processor_ms() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return 1000 * (used.ru_utime + used.ru_stime)


def in_process(name: str, reconstruct: Callable[[Points], tuple[Points, Triangles]]) -> Method:
    def run(positions: Points, runs: int) -> Outcome:
        least = math.inf
        for _ in range(runs):  # The first run also reserves memory.
            before = processor_ms()
            points, triangles = reconstruct(positions)
            least = min(least, processor_ms() - before)
        return Outcome(least, points, triangles)

    return Method(name, run)


def ours(placement: str, cell_size: float) -> Method:
    sequence = partiemc.Reconstructor(output="surface", placement=placement, spacing=1.0,
                                      cell_size=cell_size, threads=1)

    def reconstruct(positions: Points) -> tuple[Points, Triangles]:
        sequence.reset()  # Every run is a first frame.
        surface = sequence.reconstruct(positions).surface
        return surface.points, surface.triangles

    return in_process(f"{placement} {cell_size:g}", reconstruct)


def splashsurf_methods() -> list[Method]:
    try:
        import pysplashsurf
    except ImportError:
        print("surface_peers.py: no splashsurf: pysplashsurf from PyPI is missing", file=sys.stderr)
        return []

    def method(cell_size: float, is_smoothed: bool) -> Method:
        """`cell_size` in spacings; the pipeline takes it in particle radii, of which a spacing has two."""
        smoothing = {"mesh_smoothing_iters": 25, "mesh_smoothing_weights": True, "mesh_cleanup": True,
                     "normals_smoothing_iters": 10, "compute_normals": True} if is_smoothed else {}

        def reconstruct(positions: Points) -> tuple[Points, Triangles]:
            mesh, _ = pysplashsurf.reconstruction_pipeline(
                positions, particle_radius=0.5, smoothing_length=2.0, cube_size=2 * cell_size,
                iso_surface_threshold=0.6, multi_threading=False, **smoothing)
            surface = mesh.mesh if hasattr(mesh, "mesh") else mesh
            return np.asarray(surface.vertices), np.asarray(surface.triangles)

        return in_process(f"splashsurf {cell_size:g}{' smoothed' if is_smoothed else ''}", reconstruct)

    return [method(0.5, True), method(0.5, False), method(1.0, True)]


def vtk_methods() -> list[Method]:
    """A density on a volume around the particles, and its isosurface at half of the value in the bulk."""
    try:
        import vtkmodules.vtkFiltersPoints as points_filters
        from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkPoints, vtkSMPTools
        from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPolyData
        from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D, vtkWindowedSincPolyDataFilter
        from vtkmodules.vtkImagingHybrid import vtkGaussianSplatter
    except ImportError:
        print("surface_peers.py: no VTK: the package python3-vtk9 is missing", file=sys.stderr)
        return []
    vtkSMPTools.SetBackend("Sequential")

    def box(positions: Points, cell_size: float) -> tuple[Points, list[int]]:
        """Origin and numbers of nodes."""
        low = np.floor(positions.min(axis=0)) - 4
        size = np.ceil(positions.max(axis=0)) + 4 - low
        return low, [int(cells) + 1 for cells in size / cell_size]

    def sums(particles: vtkPolyData, positions: Points, cell_size: float, kernel_name: str) -> vtkImageData:
        """The sum of h^3 W at the nodes, 1 in the bulk; kernels of a smoothing length of one spacing."""
        volume = vtkImageData()
        low, nodes = box(positions, cell_size)
        volume.SetOrigin(low)
        volume.SetSpacing(cell_size, cell_size, cell_size)
        volume.SetDimensions(nodes)
        kernel = getattr(points_filters, f"vtkSPH{kernel_name}Kernel")()
        kernel.SetSpatialStep(1)
        kernel.SetDimension(3)
        interpolator = points_filters.vtkSPHInterpolator()
        interpolator.SetKernel(kernel)
        interpolator.SetInputData(volume)
        interpolator.SetSourceData(particles)
        interpolator.Update()
        interpolator.GetOutput().GetPointData().SetActiveScalars(interpolator.GetShepardSumArrayName())
        return interpolator.GetOutput()

    # Width and reach of Gaussians, in spacings.
    width, reach = 0.9, 2.5
    radii = (np.arange(1000) + 0.5) * reach / 1000
    bulk_of_gaussians = float((4 * np.pi * radii**2 * np.exp(-radii**2 / (2 * width**2))).sum() * reach / 1000)

    def splats(particles: vtkPolyData, positions: Points, cell_size: float) -> vtkImageData:
        splatter = vtkGaussianSplatter()
        splatter.SetInputData(particles)
        low, nodes = box(positions, cell_size)
        sides = cell_size * (np.array(nodes) - 1)
        splatter.SetSampleDimensions(nodes)
        splatter.SetModelBounds(np.stack([low, low + sides], axis=1).ravel())
        splatter.SetRadius(reach / sides.max())
        splatter.SetExponentFactor(-reach**2 / (2 * width**2))
        splatter.SetAccumulationModeToSum()
        splatter.ScalarWarpingOff()
        splatter.NormalWarpingOff()
        splatter.CappingOff()
        splatter.Update()
        return splatter.GetOutput()

    def method(kernel_name: str, cell_size: float, is_smoothed: bool) -> Method:
        def reconstruct(positions: Points) -> tuple[Points, Triangles]:
            particles = vtkPolyData()
            points = vtkPoints()
            points.SetData(numpy_to_vtk(positions))
            particles.SetPoints(points)
            contour = vtkFlyingEdges3D()
            if kernel_name == "Gaussian":
                contour.SetInputData(splats(particles, positions, cell_size))
                contour.SetValue(0, bulk_of_gaussians / 2)
            else:
                contour.SetInputData(sums(particles, positions, cell_size, kernel_name))
                contour.SetValue(0, 0.5)
            contour.ComputeScalarsOff()
            contour.ComputeNormalsOff()
            last = contour
            if is_smoothed:
                last = vtkWindowedSincPolyDataFilter()
                last.SetInputConnection(contour.GetOutputPort())
                last.SetNumberOfIterations(20)
                last.SetPassBand(0.1)
                last.NormalizeCoordinatesOn()
            last.Update()
            surface = last.GetOutput()
            return (vtk_to_numpy(surface.GetPoints().GetData()),
                    vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3))

        return in_process(f"VTK {kernel_name} {cell_size:g}{' smoothed' if is_smoothed else ''}", reconstruct)

    return [method("Quintic", 1, False), method("Quintic", 1, True), method("Cubic", 1, False),
            method("Cubic", 1, True), method("Gaussian", 1, False), method("Gaussian", 1, True),
            method("Cubic", 0.5, True)]


def openvdb_methods(program: pathlib.Path) -> list[Method]:
    """A level set of spheres, meshed by VolumeToMesh. See openvdb_peer.cc for the settings."""
    if not program.exists():
        print(f"surface_peers.py: no OpenVDB: {program} is missing; --help has the command that builds it",
              file=sys.stderr)
        return []

    def method(name: str, *settings: object) -> Method:
        def run(positions: Points, runs: int) -> Outcome:
            with tempfile.TemporaryDirectory() as folder:
                particles, mesh = pathlib.Path(folder, "particles"), pathlib.Path(folder, "mesh")
                positions.tofile(particles)
                command = [program, particles, mesh, runs, *settings]
                ms = float(subprocess.run([str(word) for word in command], check=True,
                                          stdout=subprocess.PIPE, text=True).stdout)
                data = mesh.read_bytes()
            point_count, triangle_count = (int(count) for count in np.frombuffer(data, "u8", 2))
            points = np.frombuffer(data, "f4", 3 * point_count, 16).reshape(-1, 3)
            triangles = np.frombuffer(data, "u4", 3 * triangle_count, 16 + points.nbytes).reshape(-1, 3)
            return Outcome(ms, points, triangles)

        return Method(f"OpenVDB {name}", run)

    # Spheres of one spacing leave no holes. Smoothed ones are moved inwards by .45, and averaged spheres have a radius
    # of .65, because this gives the ball the smallest mean deviation. Raw spheres would get holes if they were moved.
    return [method("union 1", "union", 1, 1, 0, 0, 0, 0),
            method("union 1 smoothed", "union", 1, 1, 0, 1, 0, -0.45),
            method("union 0.5", "union", 0.5, 1, 0, 0, 0, 0),
            method("union 0.5 smoothed", "union", 0.5, 1, 0, 1, 0, -0.45),
            method("average 1", "average", 1, 0.65, 2.5, 0, 0, 0),
            method("average 1 smoothed", "average", 1, 0.65, 2.5, 0, 1, 0),
            method("average 0.5", "average", 0.5, 0.65, 2.5, 0, 0, 0)]


def is_closed(triangles: Triangles) -> bool:
    """True if every edge has exactly two triangles, in opposite directions."""
    corners = triangles.astype(np.int64)
    begin, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    base = int(corners.max()) + 1
    edges = np.sort(begin * base + end)
    return bool((np.diff(edges) > 0).all()) and np.array_equal(edges, np.sort(end * base + begin))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--particles", default="100000", help="numbers of particles (default 100000)")
    parser.add_argument("--scenes", default=",".join(SCENES), help="of ball, sheet, drops (default all)")
    parser.add_argument("--runs", type=int, default=3, help="runs of each method, the least counts (default 3)")
    parser.add_argument("--methods", default="", help="parts of names, such as VTK,average; the first method is always\n"
                        "measured (default all)")
    parser.add_argument("--openvdb", type=pathlib.Path, default=pathlib.Path("build/openvdb_peer"),
                        help="program built from openvdb_peer.cc (default build/openvdb_peer)")
    options = parser.parse_args()
    methods = [ours("virtual-plane", 1.0), ours("marching-squares", 1.0), ours("virtual-plane", 0.5),
               *splashsurf_methods(), *vtk_methods(), *openvdb_methods(options.openvdb)]
    methods = methods[:1] + [method for method in methods[1:]
                             if any(part in method.name for part in options.methods.split(","))]
    print("| scene | particles | method | processor time, ms | ratio | triangles | mean deviation, h | its sd "
          "| closed |")
    print("|---|---|---|---|---|---|---|---|---|")
    for count in (int(number) for number in options.particles.split(",")):
        for name in options.scenes.split(","):
            scene = SCENES[name](count, np.random.default_rng(1))
            first = None
            for method in methods:
                outcome = method.run(scene.positions, options.runs)
                first = first or outcome.ms
                # The standard deviation leaves out an offset that is the same everywhere.
                distance = scene.distance(outcome.points.astype(np.float64))
                print(f"| {scene.name} | {len(scene.positions)} | {method.name} | {outcome.ms:.0f} "
                      f"| {outcome.ms / first:.1f} | {len(outcome.triangles)} | {np.abs(distance).mean():.4f} "
                      f"| {distance.std():.4f} | {'yes' if is_closed(outcome.triangles) else 'no'} |", flush=True)


if __name__ == "__main__":
    main()
