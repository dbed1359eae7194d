"""Accuracy and jitter of a boundary. Distances are in spacings, areas relative.

`compare` and `jitter` take any two `Boundary` objects, curves or surfaces.
"""

from functools import partial
from typing import Any, Callable, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from .advection import Advection
from .geometry import SAMPLE_STEP, Bools, Boundary, Curve, Floats, Outline, Points, cross, dot
from .motions import Motion

# Jitter ignores samples where the motion deviates from the assumed motion, or is uncertain, by more spacings than
# this. The limit is well below the differences between methods and well above the errors of truths and fits.
_MOTION_TOLERANCE = 0.1
ABSENT = float("nan")


class Deviation(NamedTuple):
    """hausdorff: largest distance from a point of one boundary to the other, both ways. mean: mean of the two mean
    distances, each over the samples of its boundary."""
    hausdorff: float = ABSENT
    mean: float = ABSENT


def nearest_neighbours(positions: Points, spacing: float) -> tuple[float, float]:
    """Mean and standard deviation of the distances of nearest neighbours, in spacings. Particles without a neighbour
    within two spacings (spray) are left out. 0 and 0 if no others are left."""
    distances = cKDTree(positions).query(positions, 2)[0][:, 1] / spacing
    near = distances[distances < 2]
    return (float(near.mean()), float(near.std())) if len(near) else (0.0, 0.0)


Trace = Callable[[Points], tuple[Points, Bools]]


def _directed(source: Boundary, target: Boundary, trace: Trace | None) -> tuple[float, float, int]:
    """Largest and mean distance from the samples of one boundary to another, and the number of samples in the mean.
    trace: moves samples, and selects those that count; None: all count, unmoved."""
    distances = []
    for points in source.samples:
        points, counts = (points, slice(None)) if trace is None else trace(points)
        distances.append(target.nearest(points[counts])[0])
    middles, corners = distances
    return max(middles.max(initial=0), corners.max(initial=0)), middles.mean() if len(middles) else 0.0, len(middles)


def _compare(a: Boundary, b: Boundary, spacing: float, there: Trace | None,
             back: Trace | None) -> tuple[Deviation, int, int]:
    """Symmetric deviation, and the numbers of samples in the mean: of a, traced by `there`, and of b by `back`."""
    (most, mean, count), (most_back, mean_back, count_back) = _directed(a, b, there), _directed(b, a, back)
    deviation = Deviation(float(max(most, most_back)) / spacing, float(mean + mean_back) / 2 / spacing)
    return deviation, count, count_back


def compare(a: Boundary, b: Boundary, spacing: float,
            counts: Callable[[Points], Bools] | None = None) -> Deviation:
    """Symmetric deviation of two boundaries. If one of them is empty, both distances are the extent of the other.
    counts: selects the samples that enter; None: all. Error of the maximum: at most half a sample step on smooth
    parts, none at corners."""
    if not a or not b:
        extent = max(a.extent, b.extent) / spacing
        return Deviation(extent, extent)
    trace = None if counts is None else lambda points: (points, counts(points))
    return _compare(a, b, spacing, trace, trace)[0]


def carried(outline: Outline, motion: Motion, frame: int, spacing: float) -> Curve:
    """An outline of frame `frame`, sampled every tenth of a spacing and moved to the next frame."""
    dense = outline.densified(SAMPLE_STEP * spacing)
    return Curve(dense.moved(motion.carry(frame, dense.points)), spacing)


def jitter(before: Boundary, after: Boundary, spacing: float, carried_truth: Boundary | None = None,
           truth: Boundary | None = None) -> Deviation:
    """Deviation between two boundaries: of the frame before, carried along by the motion, and of the frame. Where
    bodies merge, the truth does not follow the motion, and a change is no jitter. With both truths given, samples
    whose distances to them differ by more than 0.1 spacings are therefore left out."""
    if carried_truth is None or truth is None:
        return compare(before, after, spacing)

    def follows(points: Points) -> Bools:
        change = carried_truth.nearest(points)[0] - truth.nearest(points)[0]
        return np.asarray(np.abs(change) <= _MOTION_TOLERANCE * spacing)
    return compare(before, after, spacing, follows)


def known_jitter(before: Boundary, after: Boundary, advection: Advection,
                 spacing: float) -> tuple[Deviation, float]:
    """Jitter of a recording where its particles determine the motion, and the share of samples there.

    The particles around a sample carry it to the other frame: samples of the frame before forward, samples of the frame
    back. A sample counts if its position in the other frame is known within 0.1 spacings, which does not depend on the
    method.
    """
    if not before or not after:
        return Deviation(), 0.0

    def known(forward: bool, points: Points) -> tuple[Points, Bools]:
        arrival, uncertainty = advection.follow(points, forward)
        return arrival, uncertainty <= _MOTION_TOLERANCE * spacing
    found, there, back = _compare(before, after, spacing, partial(known, True), partial(known, False))
    share = (there + back) / (len(before.samples.middles) + len(after.samples.middles))
    return found if there and back else Deviation(), share


def find_defects(result: Any, truth: Curve | None) -> dict[str, float]:
    """The defects of a partiemc.Result. truth: the true boundary, None if unknown.

    self_intersections: pairs of ring segments that cross. folds: triangles that are clockwise or degenerate.
    spurious_components: outer rings without a particle. component_error, hole_error: difference of the numbers of outer
    rings and of holes from the truth. wrong_normals: share of vertices whose normal is more than a
    right angle from the true normal at the nearest point. Without the truth, the last three are 0.
    """
    rings, mesh = result.rings, result.mesh
    outer = rings.outer_of < 0
    corners = mesh.points[mesh.triangles.astype(np.int64)]
    twice = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    defects = {"self_intersections": Outline(rings.points, rings.offsets.astype(np.int64)).count_crossings(),
               "folds": int((twice <= 0).sum()),
               "spurious_components": int((outer & (rings.particle_counts == 0)).sum()),
               "component_error": 0, "hole_error": 0, "wrong_normals": 0.0}
    if truth:
        components, holes = truth.outline.loop_counts
        defects["component_error"] = abs(int(outer.sum()) - components)
        defects["hole_error"] = abs(int((~outer).sum()) - holes)
        if len(rings.points):
            expected = truth.nearest(rings.points)[2]
            defects["wrong_normals"] = float((dot(rings.normals.astype(float), expected) < 0).mean())
    return defects
