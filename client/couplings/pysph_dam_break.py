#!/usr/bin/python3
"""PySPH's two-dimensional dam break, streamed during the run.

    partiemc-server &
    client/couplings/pysph_dam_break.py --every 20 --max-steps 2000

Runs PySPH's own example with all its options. Any PySPH application can be coupled like this: a
`post_step` sends, and a thread receives.
"""

from concurrent.futures import ThreadPoolExecutor

import partiemc
from pysph.examples.dam_break_2d import DamBreak2D


class Live:
    """Streams any PySPH application whose first particles are the fluid: class Mine(Live, Theirs)."""

    dimensions = 2

    def add_user_options(self, group):
        super().add_user_options(group)
        group.add_argument("--server", help="Server address; default PARTIEMC_SERVER or this machine")
        group.add_argument("--every", type=int, default=20, help="Steps between frames")
        group.add_argument("--latest", action="store_true",
                           help="Never wait for the server; skip frames while it is behind")

    def post_step(self, solver):
        # PySPH increments the number of the step and the time after this call.
        if (solver.count + 1) % self.options.every:
            return
        fluid = self.particles[0]  # Views of PySPH's memory; `send` copies each once.
        axes = slice(self.dimensions)
        self.stream.send((fluid.x, fluid.y, fluid.z)[axes], solver.t + solver.dt,
                         volumes=fluid.m / fluid.rho, velocities=(fluid.u, fluid.v, fluid.w)[axes])


class LiveDamBreak(Live, DamBreak2D):
    pass


def receive(stream):
    for result in stream:
        if len(result.surface):
            print(f"t = {result.time!r}: {len(result.surface)} shells, volume {result.volume!r}, "
                  f"{result.surface_digest:016x}", flush=True)
            continue
        print(f"t = {result.time!r}: {len(result.rings)} rings, area {result.area!r}, "
              f"{result.rings_digest:016x} {result.mesh_digest:016x}", flush=True)


def run(simulation, **parameters):
    simulation.setup()
    options = simulation.options
    # Leaving `with` ends the stream first, then waits for the receiving thread.
    with ThreadPoolExecutor(1) as receiver, partiemc.connect(
            options.server, latest=options.latest, name="dam-break", spacing=simulation.dx,
            echo_particles=True, **parameters) as simulation.stream:
        received = receiver.submit(receive, simulation.stream)
        simulation.solve()
        simulation.stream.finish()
        received.result()


if __name__ == "__main__":
    run(LiveDamBreak())
