#!/usr/bin/env python3
"""Compares the isolines of PartiEMC with those of ContourPy, lattice by lattice.

contours_of makes the isolines of all 16 cases of marching squares, of both saddles and of seeded
random level sets; ContourPy, whose algorithms are those of Matplotlib, makes its own. Both call a
node inside where F < 0, so that ties at F = 0 compare too.

What is compared:
  every cell      its segments, by the edges that they enter and leave through: the same in all
                  cells but the saddles that are named next;
  saddles         ContourPy decides by the mean of the corners, we by the bilinear interpolant where
                  it is stationary. Where the two agree (computed here, from the corners), segments
                  are the same; where they do not, they are the other pair of segments;
  rings           where all saddles of a lattice agree: as many, each of the same points in the same
                  order with the inside on the same side, to 1e-6 cells. Our crossings stay 2^-12
                  cells away from nodes: ContourPy's are moved there before. As many outer rings and
                  holes, by the sign of their areas, and each hole inside the ring that it names.

Exit code: 0 if all agree, 1 if not, 77 if ContourPy is not installed.
"""

import argparse
import collections
import json
import struct
import subprocess
import sys

try:
    import contourpy
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

EDGE_MARGIN = 1 / 4096
TOLERANCE = 1e-6
SEED = 7973
# Two implementations that share no code. A third one, mpl2014, hands rings through saddles out in
# open pieces.
ALGORITHMS = ("serial", "mpl2005")


def level_sets(count):
    """Yields (name, F) with F[row, column]."""
    for case in range(16):
        corners = [-1.0 if case >> k & 1 else 1.0 for k in range(4)]
        yield f"case {case}", np.array([corners[:2], corners[:1:-1]])
    # Both saddles, joined and parted by both deciders, then parted by one of them only.
    for a, b, c, d in ((3, 1, 3, 1), (1, 3, 1, 3), (8, 1, 0.1, 1), (0.5, 2, 0.5, 0.1)):
        for sign in (-1, 1):
            yield f"saddle {sign} {a} {b} {c} {d}", sign * np.array([[a, -b], [-d, c]])
    random = np.random.default_rng(SEED)
    for index in range(count):
        rows, columns = random.integers(2, 15, 2)
        shape = (rows, columns)
        kind = index % 5
        sign = np.where(random.random(shape) < random.uniform(0.2, 0.8), -1.0, 1.0)
        if kind == 0:
            field = random.uniform(-1, 1, shape) + random.uniform(-0.3, 0.3)
        elif kind == 1:  # Crossings close to nodes, extreme saddles.
            field = sign * 10 ** random.uniform(-3, 3, shape)
        elif kind == 2:  # Saddles in almost every cell.
            checkers = 1 - 2 * (np.add.outer(np.arange(rows), np.arange(columns)) % 2)
            field = checkers * random.uniform(0.3, 1, shape)
        elif kind == 3:
            y, x = np.mgrid[0:rows, 0:columns]
            fx, fy = random.uniform(0.1, 1.5, 2)
            field = np.sin(fx * x + 0.3) * np.cos(fy * y) + 0.1 * random.uniform(-1, 1, shape)
        else:  # Ties: values of 0, saddles whose stationary value is 0.
            field = random.integers(-1, 2, shape).astype(float)
        yield f"seed {SEED}, lattice {index}, kind {kind}", field


def our_contours(program, fields):
    stream = b"".join(
        struct.pack("<2i", field.shape[1], field.shape[0]) + field.astype("<f4").tobytes()
        for field in fields
    )
    output = subprocess.run([program], input=stream, stdout=subprocess.PIPE, check=True).stdout
    results = [json.loads(line) for line in output.splitlines()]
    if len(results) != len(fields):
        raise RuntimeError(f"{program} answered {len(results)} of {len(fields)} lattices")
    return results


def padded(field):
    """Float32 values, as the level set keeps them, with a frame of the outside around."""
    return np.pad(field.astype(np.float32), 1, constant_values=1).astype(np.float64)


def disputed_saddles(f):
    """Cells (column, row) whose saddle the two deciders decide differently."""
    f0, f1, f2, f3 = f[:-1, :-1], f[:-1, 1:], f[1:, 1:], f[1:, :-1]
    inside = [corner < 0 for corner in (f0, f1, f2, f3)]
    rising = inside[0] & inside[2] & ~inside[1] & ~inside[3]
    falling = inside[1] & inside[3] & ~inside[0] & ~inside[2]
    determinant = f0 * f2 - f1 * f3
    joined = np.where(rising, determinant > 0, determinant < 0)
    # In ContourPy's own order of operations, so that ties come out as its do.
    joined_by_mean = 0.25 * (-f0 - f1 - f3 - f2) > 0
    saddles = rising | falling
    rows, columns = np.nonzero(saddles & (joined != joined_by_mean))
    return set(zip((columns - 1).tolist(), (rows - 1).tolist())), int(saddles.sum())


def edge_of(point):
    """The lattice edge that a point lies on, as (column, row, is_horizontal), or None at a node."""
    x, y = point
    on_row, on_column = abs(y - round(y)) < 1e-9, abs(x - round(x)) < 1e-9
    if on_row == on_column:
        return None
    return (int(np.floor(x)), round(y), True) if on_row else (round(x), int(np.floor(y)), False)


def cell_segments(rings):
    """Segments of rings, by cell: sets of (entry, exit). None if a point lies at a node."""
    cells = collections.defaultdict(set)
    for ring in rings:
        edges = [edge_of(point) for point in ring]
        if None in edges:
            return None
        for a, b in zip(edges, edges[1:] + edges[:1]):
            # The one cell that both edges bound, and which of its edges they are.
            sides = [
                {(e[0], e[1]): 0, (e[0], e[1] - 1): 2} if e[2] else
                {(e[0], e[1]): 3, (e[0] - 1, e[1]): 1}
                for e in (a, b)
            ]
            (cell,) = sides[0].keys() & sides[1].keys()
            cells[cell].add((sides[0][cell], sides[1][cell]))
    return cells


def area(ring):
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def contains(ring, point):
    x, y = point
    inside = False
    for (ax, ay), (bx, by) in zip(ring, np.roll(ring, -1, axis=0)):
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            inside = not inside
    return inside


def same_points(ours, theirs):
    """Whether two rings have the same points in the same order, from wherever each begins."""
    if len(ours) != len(theirs):
        return False
    cell = np.floor(ours)
    share = ours - cell
    at_margin = np.isclose(share, EDGE_MARGIN, atol=1e-9) | np.isclose(
        share, 1 - EDGE_MARGIN, atol=1e-9)
    tolerance = TOLERANCE + np.where(at_margin, EDGE_MARGIN, 0)
    return any(
        np.all(np.abs(np.roll(theirs, -start, axis=0) - ours) <= tolerance)
        for start in np.nonzero(np.all(np.abs(theirs - ours[0]) <= tolerance[0], axis=1))[0]
    )


class Comparison:
    def __init__(self):
        self.counts = collections.Counter()

    def compare(self, field, ours, algorithm):
        """Returns what differs, or None."""
        f = padded(field)
        columns = np.arange(f.shape[1]) - 1.0
        rows = np.arange(f.shape[0]) - 1.0
        lines = contourpy.contour_generator(columns, rows, -f, name=algorithm).lines(0)
        if algorithm == "mpl2005":  # It returns codes for drawing, too.
            lines = lines[0]
        if not all(np.array_equal(line[0], line[-1]) for line in lines):
            return "ContourPy left a line open"
        theirs = [line[:-1] for line in lines]
        rings = [np.array(ring).reshape(-1, 2) for ring in ours["rings"]]
        disputed, saddles = disputed_saddles(f)
        self.counts["lattices"] += 1
        self.counts["saddles"] += saddles
        self.counts["disputed saddles"] += len(disputed)

        their_cells = cell_segments(theirs)
        if their_cells is not None:
            our_cells = collections.defaultdict(set)
            for column, row, entry, leaving in ours["segments"]:
                our_cells[column, row].add((entry, leaving))
            self.counts["cells"] += len(our_cells)
            for cell in our_cells.keys() | their_cells.keys():
                if (our_cells[cell] == their_cells[cell]) == (cell in disputed):
                    return f"cell {cell}: ours {our_cells[cell]}, theirs {their_cells[cell]}"
        if disputed:
            return None
        return self.compare_rings(rings, theirs, ours["outer_of"])

    def compare_rings(self, rings, theirs, outer_of):
        self.counts["rings"] += len(rings)
        if len(rings) != len(theirs):
            return f"{len(rings)} rings, theirs {len(theirs)}"
        left = list(theirs)
        for ring in rings:
            match = next((k for k, other in enumerate(left) if same_points(ring, other)), None)
            if match is None:
                return f"no ring of theirs is {ring.tolist()}"
            if area(ring) * area(left[match]) < 0:
                return f"theirs runs the other way than {ring.tolist()}"
            del left[match]
        for ring, outer in zip(rings, outer_of):
            if (area(ring) < 0) != (outer >= 0):
                return "a hole is no hole by its area"
            if outer >= 0 and not contains(rings[outer], ring[0]):
                return "a hole lies outside of its ring"
        return None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", help="contours_of")
    parser.add_argument("--lattices", type=int, default=3000)
    arguments = parser.parse_args()
    named = list(level_sets(arguments.lattices))
    results = our_contours(arguments.program, [field for _, field in named])
    failed = 0
    for algorithm in ALGORITHMS:
        comparison = Comparison()
        for (name, field), ours in zip(named, results):
            difference = comparison.compare(field, ours, algorithm)
            if difference is None:
                continue
            failed += 1
            if failed <= 5:
                print(f"FAILED: {algorithm}, {name}: {difference}\n{field.tolist()}")
        print(f"{algorithm}: " + ", ".join(f"{n} {what}" for what, n in comparison.counts.items()))
        # What was compared is what the test is about.
        if not all(comparison.counts[what] > arguments.lattices
                   for what in ("cells", "saddles", "rings")):
            print("FAILED: too little was compared")
            failed += 1
    print(f"{failed} differences")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
