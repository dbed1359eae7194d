"""How good a boundary is, and how calm. Distances are in spacings, areas relative.

`compare` and `jitter` take any two `Boundary` objects, curves or surfaces.
"""

from __future__ import annotations

from functools import partial
from typing import Any, Callable, Dict, NamedTuple, Optional, Tuple

import numpy as np

from .advection import Advection
from .geometry import SAMPLE_STEP, Bools, Boundary, Curve, Floats, Outline, Points, cross, dot
from .motions import Motion

# A sample whose surroundings move otherwise than the map says by more than this is left out of
# jitter, in spacings: well below the differences of methods, well above the errors of truths and fits.
_MOTION_TOLERANCE = 0.1
ABSENT = float("nan")


class Deviation(NamedTuple):
    """hausdorff: largest distance from a point of one boundary to the other, both ways. mean: mean of the two mean
    distances, each over the samples of its boundary."""
    hausdorff: float = ABSENT
    mean: float = ABSENT


Trace = Callable[[Points], Tuple[Points, Bools]]


def _directed(source: Boundary, target: Boundary, trace: Optional[Trace]) -> Tuple[float, float, int]:
    """Largest and mean distance from the samples of one boundary to another, and the number of samples in the mean.
    trace: where each sample is, and whether it counts."""
    distances = []
    for points in (source.samples.middles, source.samples.corners):
        points, counts = (points, slice(None)) if trace is None else trace(points)
        distances.append(target.nearest(points[counts])[0])
    middles, corners = distances
    largest = max(middles.max(initial=0), corners.max(initial=0))
    return float(largest), float(middles.mean()) if len(middles) else 0.0, len(middles)


def _symmetric(there: Tuple[float, float, int], back: Tuple[float, float, int], spacing: float) -> Deviation:
    return Deviation(max(there[0], back[0]) / spacing, (there[1] + back[1]) / 2 / spacing)


def compare(a: Boundary, b: Boundary, spacing: float,
            counts: Optional[Callable[[Points], Bools]] = None) -> Deviation:
    """Symmetric deviation of two boundaries. If one of them is empty, both distances are the extent of the other.
    counts: which samples enter; all of them without it. Accuracy: the maximum misses half a sample step at most on
    smooth parts, nothing at corners."""
    if not a or not b:
        extent = max(a.extent, b.extent) / spacing
        return Deviation(extent, extent)
    trace = None if counts is None else lambda points: (points, counts(points))
    return _symmetric(_directed(a, b, trace), _directed(b, a, trace), spacing)


def carried(outline: Outline, motion: Motion, frame: int, spacing: float) -> Curve:
    """An outline of frame `frame`, sampled every tenth of a spacing and moved to the next frame."""
    dense = outline.densified(SAMPLE_STEP * spacing)
    return Curve(dense.moved(motion.carry(frame, dense.points)), spacing)


def jitter(before: Boundary, after: Boundary, spacing: float, carried_truth: Optional[Curve] = None,
           truth: Optional[Curve] = None) -> Deviation:
    """Deviation of the boundary of the frame before, carried along, from that of the frame.

    Where the truth does not move as the map says (when bodies merge), a change is no jitter: with the two truths
    given, samples whose distances to them differ by more than 0.1 spacings are left out.
    """
    if carried_truth is None or truth is None:
        return compare(before, after, spacing)

    def follows(points: Points) -> Bools:
        change = carried_truth.nearest(points)[0] - truth.nearest(points)[0]
        return np.asarray(np.abs(change) <= _MOTION_TOLERANCE * spacing)
    return compare(before, after, spacing, follows)


def known_jitter(before: Boundary, after: Boundary, advection: Advection,
                 spacing: float) -> Tuple[Deviation, float]:
    """Jitter of a recording where its particles determine the motion, and the share of samples there.

    Samples of the frame before go forward and those of the frame back, each by its own particles. A sample counts if
    its place in the other frame is known within 0.1 spacings. That depends on the particles around it alone, never on
    the method.
    """
    if not before or not after:
        return Deviation(), 0.0

    def known(forward: bool, points: Points) -> Tuple[Points, Bools]:
        arrival, uncertainty = advection.follow(points, forward)
        return arrival, uncertainty <= _MOTION_TOLERANCE * spacing
    there = _directed(before, after, partial(known, True))
    back = _directed(after, before, partial(known, False))
    share = (there[2] + back[2]) / (len(before.samples.middles) + len(after.samples.middles))
    return _symmetric(there, back, spacing) if there[2] and back[2] else Deviation(), share


def find_defects(result: Any, truth: Optional[Curve]) -> Dict[str, float]:
    """What is wrong with a partiemc.Result, in numbers. truth: the true boundary, None if unknown.

    self_intersections: pairs of ring segments that cross. folds: triangles that are clockwise or degenerate.
    spurious_components: outer rings without a particle. component_error, hole_error: difference of their numbers from
    the truth's. wrong_normals: share of vertices whose normal is more than a right angle from that of the nearest
    true point.
    """
    rings, mesh = result.rings, result.mesh
    outer = rings.outer_of < 0
    corners = mesh.points[mesh.triangles.astype(np.int64)]
    twice = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    defects = {
        "self_intersections": Outline(rings.points, rings.offsets.astype(np.int64)).count_crossings(),
        "folds": int((twice <= 0).sum()),
        "spurious_components": int((outer & (rings.particle_counts == 0)).sum()),
        "component_error": 0.0, "hole_error": 0.0, "wrong_normals": 0.0}
    if truth:
        components, holes = truth.outline.loop_counts
        defects["component_error"] = abs(int(outer.sum()) - components)
        defects["hole_error"] = abs(int((~outer).sum()) - holes)
        if len(rings.points):
            expected = truth.nearest(rings.points)[2]
            defects["wrong_normals"] = float((dot(rings.normals.astype(float), expected) < 0).mean())
    return defects
