"""A box of water in space that is pushed along x, in PySPH, cut by planes while it sloshes.

    PYTHONPATH=build/release/python python3 tests/couplings/sloshing_box.py

Prints for each frame how far the areas of sixteen sections along x and along y, times their distance,
differ from the volume of the water, in percent, and the means and maxima of these errors. Run by hand:
it takes some minutes.
"""
import tempfile

import numpy
from pysph.base.kernels import CubicSpline
from pysph.base.utils import get_particle_array
from pysph.solver.application import Application
from pysph.sph.scheme import WCSPHScheme

import partiemc

LENGTH, WIDTH, HEIGHT, DEPTH = 1.0, 0.4, 0.6, 0.3
SPACING = 0.025
DENSITY = 1000.0
SOUND = 10 * (2 * 9.81 * DEPTH) ** 0.5
PLANES = 16


def sections_along(axis, length):
    places = (numpy.arange(PLANES) + 0.5) * length / PLANES
    return partiemc.Reconstructor(spacing=SPACING, slice=(axis, places[0]),
                                  sections=[{"slice": (axis, place)} for place in places[1:]])


class SloshingBox(Application):
    def create_scheme(self):
        return WCSPHScheme(["fluid"], ["walls"], dim=3, rho0=DENSITY, c0=SOUND, h0=1.3 * SPACING, hdx=1.3,
                           gx=3.0, gz=-9.81, alpha=0.2, gamma=7.0)

    def configure_scheme(self):
        step = 0.25 * 1.3 * SPACING / (1.1 * SOUND)
        self.scheme.configure_solver(kernel=CubicSpline(dim=3), dt=step, tf=1.0, adaptive_timestep=False,
                                     pfreq=10 ** 9)
        self.errors = []
        self.along = [("x", LENGTH, sections_along("x", LENGTH)), ("y", WIDTH, sections_along("y", WIDTH))]

    def create_particles(self):
        layers = 3

        def places(length):
            return (numpy.arange(-layers, round(length / SPACING) + layers) + 0.5) * SPACING

        x, y, z = (each.ravel() for each in
                   numpy.meshgrid(places(LENGTH), places(WIDTH), places(HEIGHT), indexing="ij"))
        inside = (x > 0) & (x < LENGTH) & (y > 0) & (y < WIDTH) & (z > 0)
        arrays = [get_particle_array(name=name, x=x[of], y=y[of], z=z[of], m=DENSITY * SPACING ** 3,
                                     rho=DENSITY, h=1.3 * SPACING)
                  for name, of in (("fluid", inside & (z < DEPTH)), ("walls", ~inside & (z < HEIGHT)))]
        self.scheme.setup_properties(arrays)
        return arrays

    def post_step(self, solver):
        if solver.t < 0.05 * len(self.errors):
            return
        fluid = self.particles[0]
        volumes = (fluid.m / fluid.rho).astype(numpy.float32)
        positions = numpy.column_stack([fluid.x, fluid.y, fluid.z])
        errors = []
        for _, length, reconstructor in self.along:
            result = reconstructor.reconstruct(positions, solver.t, volumes=volumes)
            area = sum(each.area for each in [result, *result.sections])
            errors.append(100 * (area * length / PLANES / volumes.sum(dtype=float) - 1))
        self.errors.append(errors)
        print(f"{solver.t:.2f} s: along x {errors[0]:+.2f} %, along y {errors[1]:+.2f} %", flush=True)


with tempfile.TemporaryDirectory() as folder:
    box = SloshingBox(fname="sloshing_box", output_dir=folder)
    box.run(["--disable-output", "--directory", folder])
off = numpy.abs(box.errors)
for (axis, _, _), mean, largest in zip(box.along, off.mean(axis=0), off.max(axis=0)):
    print(f"along {axis}: mean {mean:.2f} %, largest {largest:.2f} %")
