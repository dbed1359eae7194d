#!/usr/bin/python3
"""Draws the SVG files in `pictures`: runs each simulation, watches its stream, keeps a few frames.

    client/couplings/draw.py NAME...        NAME: pysph_dam_break, lammps_column, numpy_drops

Requires PYTHONPATH as in client/python/README.md, and PARTIEMC_SERVER_PROGRAM or a partiemc-server
in PATH. pysph_dam_break takes a minute.
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy
import partiemc

HERE = pathlib.Path(__file__).parent
# For each picture: stream name, options of the simulation, times to draw, visible box.
PICTURES = {
    "pysph_dam_break": ("dam-break", ["--every", "50", "--tf", "0.96", "--disable-output",
                                      "--quiet"], [0.1, 0.4, 0.7, 0.95], (0, 0, 4.1, 2.1)),
    "lammps_column": ("column", ["--every", "100", "--steps", "40000"], [0, 5, 10, 40],
                      (0, 0, 121, 51)),
    "numpy_drops": ("drops", ["--every", "10", "--steps", "800"], [0.1, 0.3, 0.5, 0.7],
                    (-1.4, -1.6, 1.4, 1.6)),
}


def watched(address, name, times, coupling):
    """Returns the stream's first result at or after each of `times`."""
    while not any(stream["name"] == name for stream in partiemc.streams(address)):
        if coupling.poll() is not None:
            sys.exit(f"{coupling.args[0]} has ended with {coupling.returncode}")
        time.sleep(0.02)
    kept = []
    with partiemc.watch(address, name, mode="every", from_sequence=0) as watch:
        for result in watch:
            if len(kept) < len(times) and result.time >= times[len(kept)] - 1e-9:
                kept.append(result)
    if len(kept) < len(times):
        sys.exit(f"{name} ended before t = {times[len(kept)]}")
    return kept


def rings_path(rings, scale, left, top):
    """Data of an SVG path in tenths of a pixel: each vertex relative to the previous one."""
    words = []
    for ring in rings:
        points = numpy.rint((ring - (left, top)) * (scale, -scale)).astype(int)
        steps = numpy.diff(points, axis=0)
        words.append(f"M{points[0, 0]} {points[0, 1]}l"
                     + " ".join(f"{x} {y}" for x, y in steps[(steps != 0).any(axis=1)]) + "z")
    return "".join(words)


def svg(results, box):
    """Panels side by side, each with its time."""
    left, bottom, right, top = box
    width, height, gap = 2400, 2400 * (top - bottom) / (right - left), 120
    panels = []
    for k, result in enumerate(results):
        panels.append(f'<g transform="translate({k * (width + gap)} 0)">'
                      f'<path d="{rings_path(result.rings, width / (right - left), left, top)}"/>'
                      f'<text x="0" y="{height + 170:.0f}">t = {result.time:.3g}</text></g>')
    whole = len(results) * (width + gap) - gap
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{whole / 10:.0f}" '
            f'viewBox="-20 -20 {whole + 40} {height + 240:.0f}">\n'
            '<rect x="-20" y="-20" width="100%" height="100%" fill="#fff"/>\n'
            '<g fill="#cfe3f5" fill-rule="evenodd" stroke="#123a5c" stroke-width="12" '
            'stroke-linejoin="round">\n' + "\n".join(panels) + "\n</g>\n"
            '<style>text{font:150px sans-serif;fill:#123a5c;stroke:none}</style>\n</svg>\n')


def draw(name):
    stream, options, times, box = PICTURES[name]
    with tempfile.TemporaryDirectory() as folder:
        address = f"unix:{folder}/server.sock"
        server = subprocess.Popen([os.environ.get("PARTIEMC_SERVER_PROGRAM", "partiemc-server"),
                                   "--address", address], stderr=subprocess.DEVNULL)
        try:
            while not os.path.exists(f"{folder}/server.sock"):
                time.sleep(0.02)
            coupling = subprocess.Popen([str(HERE / f"{name}.py"), "--server", address, *options],
                                        cwd=folder, stdout=subprocess.DEVNULL)
            results = watched(address, stream, times, coupling)
            coupling.wait()
        finally:
            server.kill()
            server.wait()
    (HERE / "pictures" / f"{name}.svg").write_text(svg(results, box))


if __name__ == "__main__":
    for wanted in sys.argv[1:] or sys.exit(__doc__):
        draw(wanted)
