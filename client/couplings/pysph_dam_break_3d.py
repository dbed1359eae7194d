#!/usr/bin/python3
"""PySPH's three-dimensional dam break against an obstacle, streamed during the run: surfaces.

    partiemc-server &
    client/couplings/pysph_dam_break_3d.py --every 20 --dx 0.05 --tf 1

Runs PySPH's own example with all its options.
"""

from pysph.examples.dam_break_3d import DamBreak3D

from pysph_dam_break import Live, run


class LiveDamBreak3D(Live, DamBreak3D):
    dimensions = 3


if __name__ == "__main__":
    run(LiveDamBreak3D(), output="surface")
