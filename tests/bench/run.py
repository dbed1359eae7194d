#!/usr/bin/env python3
"""Builds the benchmark, runs it and computes its ratios.

Stages, peers and the floor run under Google Benchmark (partiemc-bench), in one process and in
random order; end to end, `partiemc load` streams to a server process. README.md explains the
metrics."""

import argparse
import csv
import json
import math
import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BIN = ROOT / "build/release/bin"
EXPECTED = Path(__file__).with_name("expected.csv")
HEAD = ["metric", "value", "better", "margin"]
STAGES = ("bins", "field", "crossings", "rings", "normals", "vertices", "identities", "mesh",
          "attributes")
SCENES = ("10k", "100k", "1m", "4m", "islands_1m", "dam_break", "load_1m")
WORSE = 3  # Exit code for a ratio that is worse than recorded.


class Measures:
    """The repetitions of Google Benchmark's JSON. A time is the least one, because other work on the
    machine only adds to it."""

    def __init__(self, document):
        self.runs = {}
        for run in document["benchmarks"]:
            if run["run_type"] == "iteration":
                name = run["name"].split("/iterations:")[0]
                self.runs.setdefault(name, []).append(run)

    def least(self, name, field="cpu_time"):
        return min(run[field] for run in self.runs[name])

    def most(self, name, field):
        return max(run[field] for run in self.runs[name])

    def stages(self, name, *stages):
        return sum(self.least(name, f"{stage}_cpu_ms") for stage in stages)

    def scenes(self, kind):
        return [name.split("/")[1] for name in self.runs if name.startswith(kind + "/")]


def core_metrics(measures):
    """Times in ms and ratios of processor time."""
    metrics = {}
    for scene in measures.scenes("frame"):
        frame = "frame/" + scene
        total = measures.least(frame)
        field = measures.stages(frame, "bins", "field")
        metrics[f"compute_ms_{scene}"] = measures.least(frame, "real_time")
        metrics[f"compute_cpu_ms_{scene}"] = total
        metrics[f"frame_over_field_{scene}"] = total / field
        with_ids = f"frame_with_ids/{scene}"
        metrics[f"ids_over_plain_{scene}"] = measures.least(with_ids) / total
        metrics[f"ids_over_plain_state_{scene}"] = (
            measures.least(with_ids, "state_bytes") / measures.least(frame, "state_bytes"))
        for stage in STAGES:
            metrics[f"{stage}_cpu_ms_{scene}"] = measures.stages(frame, stage)
        if f"floor/{scene}" in measures.runs:
            floor = measures.least(f"floor/{scene}")
            metrics[f"scatter_cpu_ms_{scene}"] = floor
            metrics[f"field_over_scatter_{scene}"] = field / floor
        if f"frame_two_threads/{scene}" in measures.runs:
            two = "frame_two_threads/" + scene
            metrics[f"two_threads_speedup_{scene}"] = (
                measures.least(frame, "real_time") / measures.least(two, "real_time"))
            metrics[f"two_threads_cpu_overhead_{scene}"] = measures.least(two) / total
    metrics["two_threads_available"] = (
        measures.least("spin/1", "real_time") / measures.least("spin/2", "real_time"))
    metrics["processor_share"] = min(
        run["cpu_time"] / run["real_time"] for run in measures.runs["spin/1"])
    metrics["sparse_over_compact_1m"] = (
        metrics["compute_cpu_ms_islands_1m"] / metrics["compute_cpu_ms_1m"])
    metrics["sparse_field_over_compact_1m"] = (
        measures.stages("frame/islands_1m", "bins", "field")
        / measures.stages("frame/1m", "bins", "field"))
    if "compute_cpu_ms_4m" in metrics:
        metrics["particle_cpu_4m_over_100k"] = (
            metrics["compute_cpu_ms_4m"] / metrics["compute_cpu_ms_100k"] / 40)
    metrics["allocations_per_warm_frame"] = measures.most("allocations/100k", "calls")
    return metrics


def matter_metrics(measures):
    """Ratios of processor time per particle over that of a frame without the feature."""
    plain = measures.least("frame/100k") / 1e5
    metrics = {}
    for case in measures.scenes("matter"):
        name = "matter/" + case
        a_particle = measures.least(name) / measures.least(name, "particles")
        metrics[f"{case}_over_plain"] = a_particle / plain
    return metrics


def peer_metrics(measures):
    """Speedup over VTK by processor time."""
    contours = measures.least("vtk_contours/1024")
    return {
        "field_vs_vtk_sph_1m":
            measures.least("vtk_sph/1m") / measures.stages("frame/1m", "bins", "field"),
        "contours_vs_vtk_1024":
            contours / measures.stages("contours/1024", "crossings", "rings"),
        "linear_contours_vs_vtk_1024":
            contours / measures.stages("linear_contours/1024", "crossings", "rings", "normals",
                                       "vertices", "identities"),
        "fill_vs_vtk_1024": measures.least("vtk_fill/1024") / measures.stages("fill/1024", "mesh"),
    }


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Server:
    """A partiemc-server on loopback."""

    def __init__(self):
        self.metrics = f"127.0.0.1:{free_port()}"
        self.folder = tempfile.TemporaryDirectory()
        address = Path(self.folder.name) / "address"
        self.process = subprocess.Popen(
            [BIN / "partiemc-server", "--address", "127.0.0.1:0", "--port-file", address,
             "--metrics", self.metrics, "--history-bytes", "0", "--log-level", "warn"])
        deadline = time.monotonic() + 20
        while not (address.exists() and address.read_text()):
            if self.process.poll() is not None or time.monotonic() > deadline:
                sys.exit("bench: the server does not start")
            time.sleep(0.02)
        self.address = address.read_text().strip()

    def megabytes(self, field):
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith(field + ":"):
                return int(line.split()[1]) / 1024
        raise KeyError(field)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(30)
        self.folder.cleanup()


def load(server, particles, seconds):
    return json.loads(subprocess.run(
        [BIN / "partiemc", "load", "--server", server.address, "--metrics", server.metrics,
         "--streams", "1", "--rate", "0", "--no-ids", "--particles", str(particles), "--seconds",
         str(seconds), "--json", "--quiet"], check=True, capture_output=True, text=True).stdout)


def end_to_end_metrics(measures, seconds):
    metrics = {}
    for name, particles in (("10k", 10_000), ("100k", 100_000), ("1m", 1_000_000)):
        progress(f"end to end: {name}")
        with Server() as server:
            found = load(server, particles, seconds)
            early = server.megabytes("VmRSS")
            cpu = found["client_cpu_ms"] + found["server_cpu_ms"]
            metrics[f"end_to_end_ms_{name}"] = 1000 * found["seconds"] / found["frames"]
            metrics[f"end_to_end_cpu_ms_{name}"] = cpu
            for percentile in ("p50", "p90", "p99"):
                metrics[f"end_to_end_{percentile}_ms_{name}"] = found["answers"][percentile + "_ms"]
            metrics[f"end_to_end_over_floor_{name}"] = (
                metrics[f"end_to_end_ms_{name}"] / measures.least("floor/1m"))
            metrics[f"server_peak_mb_{name}"] = server.megabytes("VmHWM")
            if name == "10k":
                load(server, particles, seconds)
                metrics["server_end_over_early_memory_10k"] = server.megabytes("VmRSS") / early
            if name == "1m":
                metrics["end_to_end_cpu_over_compute_1m"] = cpu / measures.least("frame/load_1m")
                metrics["server_peak_over_frame_1m"] = server.megabytes("VmHWM") / (8e6 / 2**20)
    return metrics


def read_expectations(path):
    """Rows of HEAD. A row that cannot be used ends the run with its text."""
    rows = []
    with open(path, newline="", encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    for row in csv.DictReader(lines):
        try:
            row["value"], row["margin"] = float(row["value"]), float(row["margin"])
            if row["better"] not in ("lower", "higher") or row["margin"] < 1 or None in row:
                raise ValueError
        except (TypeError, ValueError):
            sys.exit(f"bench: {path}: cannot use the row {','.join(map(str, row.values()))}")
        rows.append(row)
    return rows


def failures(expectations, metrics):
    """A line for each metric that is worse than its limit or was not measured, by its name."""
    lines = {}
    for row in expectations:
        value = metrics.get(row["metric"], math.nan)
        lower = row["better"] == "lower"
        limit = row["value"] * row["margin"] if lower else row["value"] / row["margin"]
        if not (value <= limit if lower else value >= limit):
            lines[row["metric"]] = (f"{row['metric']} is {value:.3g}, recorded "
                                    f"{row['value']:.3g}, limit {limit:.3g}")
    return lines


def failures_twice(expectations, metrics, measure_again):
    """The failures of metrics that fail in `metrics` and in a second measurement.

    measure_again: returns the metrics of the second measurement; called if a metric fails.
    Prints the failures of both measurements.
    """
    first = failures(expectations, metrics)
    if not first:
        return {}
    print("\n".join(first.values()))
    progress("measuring again")
    # One failure may be noise, so a metric that fails only in the second measurement passes.
    second = failures([row for row in expectations if row["metric"] in first], measure_again())
    print("\n".join(second.values()))
    return second


def refresh(path, metrics):
    """Replaces the values in the file and leaves everything else."""
    lines = Path(path).read_text(encoding="utf-8").splitlines()
    for index, line in enumerate(lines):
        fields = line.split(",")
        if not line.startswith("#") and fields[0] in metrics:
            fields[1] = f"{metrics[fields[0]]:.3g}"
            lines[index] = ",".join(fields)
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def page(metrics, measures):
    """bench.md: the stages as a table, then every metric."""
    lines = ["# Benchmark", "", "Processor milliseconds of one frame on one thread, least of the repetitions.", "",
             "| scene | " + " | ".join(STAGES) + " | frame |", "|---" * (len(STAGES) + 2) + "|"]
    for scene in (scene for scene in SCENES if f"frame/{scene}" in measures.runs):
        figures = [metrics[f"{stage}_cpu_ms_{scene}"] for stage in STAGES]
        figures.append(metrics[f"compute_cpu_ms_{scene}"])
        lines.append(f"| {scene} | " + " | ".join(f"{figure:.3g}" for figure in figures) + " |")
    lines += ["", "| metric | value |", "|---|---|"]
    lines += [f"| {name} | {value:.3g} |" for name, value in metrics.items()]
    return "\n".join(lines) + "\n"


def progress(text):
    print(f"bench: {text}", file=sys.stderr, flush=True)


def build():
    progress("building")
    for command in (["cmake", "--preset", "release", "-DPARTIEMC_VTK=ON"],
                    ["cmake", "--build", "build/release", "-j", str(os.cpu_count()), "--target",
                     "partiemc-bench", "partiemc", "partiemc-server"]):
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              text=True)
        if done.returncode != 0:
            sys.exit(done.stdout + "\nbench: cannot build; docker/install.sh bench installs the "
                                   "packages")


def measure(output, quick):
    output.mkdir(parents=True, exist_ok=True)
    document = output / "bench.json"
    progress("stages and peers")
    subprocess.run(
        [BIN / "partiemc-bench", *(["--quick", "--benchmark_filter=-_r2"] if quick else []),
         "--benchmark_enable_random_interleaving=true",
         f"--benchmark_repetitions={3 if quick else 5}", f"--benchmark_out={document}",
         "--benchmark_out_format=json"], check=True, stdout=subprocess.DEVNULL)
    measures = Measures(json.loads(document.read_text()))
    metrics = core_metrics(measures) | matter_metrics(measures) | peer_metrics(measures)
    metrics |= end_to_end_metrics(measures, 6 if quick else 20)
    (output / "bench.md").write_text(page(metrics, measures))
    with open(output / "bench.csv", "w", encoding="utf-8") as file:
        file.write("metric,value\n")
        file.writelines(f"{name},{value!r}\n" for name, value in metrics.items())
    progress(f"see {output / 'bench.md'}")
    return metrics


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "build/bench", metavar="DIR",
                        help="folder for bench.md, bench.csv and bench.json (build/bench)")
    parser.add_argument("--quick", action="store_true",
                        help="fewer scenes and repetitions: about a minute")
    parser.add_argument("--check", action="store_true",
                        help="exit with 3 if a ratio is worse than expected.csv allows in both of two "
                             "measurements")
    parser.add_argument("--refresh", action="store_true",
                        help="write the ratios of this run into expected.csv")
    arguments = parser.parse_args()
    expectations = read_expectations(EXPECTED)
    build()
    metrics = measure(arguments.output, arguments.quick)
    if arguments.refresh:
        refresh(EXPECTED, metrics)
    is_worse = arguments.check and failures_twice(
        expectations, metrics, lambda: measure(arguments.output, arguments.quick))
    sys.exit(WORSE if is_worse else 0)


if __name__ == "__main__":
    main()
