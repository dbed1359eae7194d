#!/usr/bin/python3
"""Five small free-surface flows with PySPH (Debian: python3-pysph 1.0b1), as CSV files per frame.

    pysph_scenes.py SCENE DIRECTORY     SCENE: ellipse, square, sloshing, splash, drop_on_film

Lengths in metres. Each scene is known in part: the ellipse stays one, walls are straight and lie
half a spacing beside the first particles, and every particle stands for an area of spacing^2.
"""
import glob
import os
import sys

import numpy as np
from pysph.base.kernels import QuinticSpline
from pysph.base.utils import get_particle_array
from pysph.solver.application import Application
from pysph.solver.utils import load
from pysph.sph.equation import Equation, Group
from pysph.sph.wc.edac import EDACScheme

LAYERS = 4  # Of wall particles.


class CentralForce(Equation):
    """A velocity field that is linear in the position stays linear, and an ellipse an ellipse."""

    def initialize(self, d_idx, d_x, d_y, d_au, d_av):
        d_au[d_idx] -= d_x[d_idx]
        d_av[d_idx] -= d_y[d_idx]


class Shaking(Equation):
    """The tank's own acceleration, seen from the tank."""

    def __init__(self, dest, sources, amplitude, frequency):
        self.amplitude = amplitude
        self.frequency = frequency
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_au, t):
        d_au[d_idx] += self.amplitude * cos(self.frequency * t)


def lattice(x0, y0, x1, y1, dx):
    x, y = np.mgrid[x0 + dx / 2:x1:dx, y0 + dx / 2:y1:dx]
    return x.ravel(), y.ravel()


def tank(width, height, dx):
    """Wall particles around [0, width] x [0, height], open above."""
    x, y = lattice(-LAYERS * dx, -LAYERS * dx, width + LAYERS * dx, height, dx)
    wall = (x < 0) | (x > width) | (y < 0)
    return x[wall], y[wall]


class Scene:
    gravity = 0.0
    speed = 1.0  # The largest that is expected; sound is ten times as fast.
    walls = None
    extra = ()


def ellipse():
    s = Scene()
    s.dx, s.frames, s.step, s.speed = 1 / 15, 16, 0.1, 1.2
    x, y = lattice(-1.2, -1.2, 1.2, 1.2, s.dx)
    inside = x * x + y * y < 1
    s.x, s.y = x[inside], y[inside]
    s.u, s.v = 0.6 * s.x - 0.4 * s.y, -0.6 * s.y + 0.4 * s.x
    s.extra = [CentralForce('fluid', None)]
    return s


def square():
    s = Scene()
    s.dx, s.frames, s.step, s.speed = 1 / 26, 16, 0.06, 1.5
    s.x, s.y = lattice(-0.5, -0.5, 0.5, 0.5, s.dx)
    s.u, s.v = 2 * s.y, -2 * s.x
    return s


def sloshing():
    s = Scene()
    s.dx, s.frames, s.step, s.speed, s.gravity = 1 / 45, 16, 0.1, 2.0, -9.81
    s.x, s.y = lattice(0, 0, 1, 16 * s.dx, s.dx)
    s.u, s.v = 0 * s.x, 0 * s.x
    s.walls = tank(1, 1, s.dx)
    s.extra = [Shaking('fluid', None, 1.5, 4.9)]
    return s


def splash():
    s = Scene()
    s.dx, s.frames, s.step, s.speed, s.gravity = 1 / 50, 16, 0.07, 3.5, -9.81
    s.x, s.y = lattice(0, 0, 18 * s.dx, 36 * s.dx, s.dx)
    s.u, s.v = 0 * s.x, 0 * s.x
    s.walls = tank(1, 1, s.dx)
    return s


def drop_on_film():
    s = Scene()
    s.dx, s.frames, s.step, s.speed, s.gravity = 1 / 50, 16, 0.02, 3.0, -9.81
    x, y = lattice(0, 0, 1.4, 7 * s.dx, s.dx)
    a, b = lattice(0.5, 0.1, 0.9, 0.6, s.dx)
    drop = (a - 0.7) ** 2 + (b - 0.32) ** 2 < 0.15 ** 2
    s.x, s.y = np.append(x, a[drop]), np.append(y, b[drop])
    s.u, s.v = 0 * s.x, np.where(s.y > 0.15, -2.0, 0.0)
    s.walls = tank(1.4, 0.8, s.dx)
    return s


class Flow(Application):
    def __init__(self, scene, directory):
        self.scene = scene
        super().__init__(fname='flow', output_dir=directory)

    def create_particles(self):
        s = self.scene
        h = 1.3 * s.dx
        fluid = get_particle_array(name='fluid', x=s.x, y=s.y, u=s.u, v=s.v, m=s.dx ** 2, h=h,
                                   rho=1.0)
        arrays = [fluid]
        if s.walls is not None:
            arrays.append(get_particle_array(name='wall', x=s.walls[0], y=s.walls[1],
                                             m=s.dx ** 2, h=h, rho=1.0))
        self.scheme.setup_properties(arrays)
        fluid.add_property('known', type='int')
        fluid.known[:] = np.arange(len(s.x))
        fluid.add_output_arrays(['known'])
        return arrays

    def create_scheme(self):
        s = self.scene
        sound = 10 * s.speed
        scheme = EDACScheme(['fluid'], [] if s.walls is None else ['wall'], dim=2, rho0=1.0,
                            c0=sound, nu=0.0, alpha=0.1, gy=s.gravity, h=1.3 * s.dx, pb=0.0,
                            eps=0.5 if s.walls is not None else 0.0)
        scheme.configure_solver(kernel=QuinticSpline(dim=2), tf=s.step * (s.frames - 1),
                                dt=0.125 * 1.3 * s.dx / sound, pfreq=1000000,
                                output_at_times=[s.step * k for k in range(1, s.frames)])
        return scheme

    def create_equations(self):
        equations = self.scheme.get_equations()
        if self.scene.extra:
            equations.append(Group(equations=list(self.scene.extra)))
        return equations


def main():
    name, directory = sys.argv[1], sys.argv[2]
    sys.argv[1:] = []
    scene = globals()[name]()
    raw = os.path.join(directory, 'raw')
    Flow(scene, raw).run()
    times, frames = [], []
    for file in glob.glob(os.path.join(raw, 'flow_*.*')):
        if not file.endswith(('.npz', '.hdf5')):
            continue
        data = load(file)
        time = data['solver_data']['t']
        if times and min(abs(time - t) for t in times) < 0.1 * scene.step:
            continue
        times.append(time)
        frames.append(data['arrays']['fluid'])
    order = np.argsort(times)
    with open(os.path.join(directory, 'times.csv'), 'w') as out:
        out.writelines('%.6g\n' % times[k] for k in order)
    for frame, k in enumerate(order):
        fluid = frames[k]
        rows = np.argsort(fluid.known)
        with open(os.path.join(directory, 'frame_%02d.csv' % frame), 'w') as out:
            out.write('id,x,y\n')
            for row in rows:
                out.write('%d,%.5f,%.5f\n' % (fluid.known[row], fluid.x[row], fluid.y[row]))
    print(name, len(order), 'frames of', len(scene.x), 'particles, spacing', scene.dx)


if __name__ == '__main__':
    main()
