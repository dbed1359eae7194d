#!/usr/bin/python3
"""Two drops in space that collide off centre, with PySPH (Debian: python3-pysph 1.0b1): a CSV file
per frame, for `partiemc convert`.

    colliding_drops.py DIRECTORY
"""
import glob
import os
import sys

import numpy as np
from pysph.base.kernels import QuinticSpline
from pysph.base.utils import get_particle_array
from pysph.solver.application import Application
from pysph.solver.utils import load
from pysph.sph.wc.edac import EDACScheme

SPACING = 0.1
RADIUS = 0.75
SPEED = 1.0  # Of each drop.
SOUND = 12 * SPEED
FRAMES, INTERVAL = 50, 0.07


def drop(centre):
    line = np.arange(-RADIUS, RADIUS, SPACING) + SPACING / 2
    points = np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3)
    return points[np.linalg.norm(points, axis=1) < RADIUS] + centre


class Collision(Application):
    def create_particles(self):
        left, right = drop((-0.9, 0.22, 0)), drop((0.9, -0.22, 0))
        x, y, z = np.concatenate([left, right]).T
        u = np.repeat([SPEED, -SPEED], [len(left), len(right)])
        fluid = get_particle_array(name='fluid', x=x, y=y, z=z, u=u, m=SPACING ** 3, rho=1.0,
                                   h=1.2 * SPACING)
        self.scheme.setup_properties([fluid])
        fluid.add_property('known', type='int')
        fluid.known[:] = np.arange(len(x))
        fluid.add_output_arrays(['known'])
        return [fluid]

    def create_scheme(self):
        scheme = EDACScheme(['fluid'], [], dim=3, rho0=1.0, c0=SOUND, nu=0.01, alpha=0.2,
                            h=1.2 * SPACING, pb=0.0, eps=0.0)
        scheme.configure_solver(kernel=QuinticSpline(dim=3), tf=INTERVAL * (FRAMES - 1),
                                dt=0.2 * 1.2 * SPACING / SOUND, pfreq=1000000,
                                output_at_times=[INTERVAL * k for k in range(1, FRAMES)])
        return scheme


def main():
    directory = sys.argv[1]
    sys.argv[1:] = []
    raw = os.path.join(directory, 'raw')
    Collision(fname='drops', output_dir=raw).run()
    frames = {}
    for file in glob.glob(os.path.join(raw, 'drops_*.*')):
        if file.endswith(('.npz', '.hdf5')):
            data = load(file)
            frames[round(data['solver_data']['t'] / INTERVAL)] = data
    for index, data in sorted(frames.items()):
        fluid = data['arrays']['fluid']
        rows = np.argsort(fluid.known)
        columns = np.stack([fluid.known, fluid.x, fluid.y, fluid.z], axis=1)[rows]
        np.savetxt(os.path.join(directory, f'frame_{index:02d}.csv'), columns, delimiter=',',
                   header='id,x,y,z', comments='', fmt=['%d', '%.5f', '%.5f', '%.5f'])
    print(len(frames), 'frames of', len(rows), 'particles')


if __name__ == '__main__':
    main()
