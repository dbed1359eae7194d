"""Scenes of real matter with known truth: different sizes, grains, phases, walls and periodic boxes. Each is measured
with the feature and without it. Lengths are in spacings, areas relative.

The truth, its particles and all random choices follow from a recipe. Scenes and seeds differ from those in tests/core.
No constant of the core was chosen by these scenes.
"""

import warnings
from dataclasses import dataclass
from typing import Any, Callable, NamedTuple, Sequence as Seq

import numpy as np
import partiemc
from shapely import affinity
from shapely.geometry import Polygon, box
from shapely.ops import unary_union

from .geometry import Curve, Floats, Outline, Points, ellipse_ring, norm, sample_curve
from .metrics import ABSENT, compare
from .motions import Similarity
from .packings import Draw, fill_sizes, pile_grains, shrink_to_grains, spray_grains
from .samplers import SAMPLERS, Rng
from .shapes import make_shape
from .study import outline_of

FEATURE, WITHOUT = "feature", "without"
_CHORD = 5e-4  # Largest distance of curves from their chords.


@dataclass(frozen=True)
class Recipe:
    """A scene before it is made. noise: standard deviation along each axis, in the particles' own sizes."""
    group: str
    kind: str
    shape: str
    noise: float
    seed: int

    @property
    def name(self) -> str:
        return f"{self.shape}-{self.seed}".lstrip("-")


class Measured(NamedTuple):
    """A scene's particles (N, 2) and truth; numbers by metric and the outline, with the feature and without it."""
    particles: Points
    truth: Outline
    values: dict[str, dict[str, float]]
    outlines: dict[str, Outline]


def _reconstruct(positions: Points, **arguments: Any) -> Any:
    """The result of one frame. Ignores warnings: doubts about the spacing are expected without the
    feature."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", partiemc.PartiemcWarning)
        return partiemc.reconstruct(positions, threads=1, **arguments)


def _with_and_without(particles: Points, truth: Outline,
                      run: Callable[[bool], tuple[Outline, dict[str, float]]]) -> Measured:
    """run: the outline and its numbers, with the feature if its argument is true."""
    found = {FEATURE: run(True), WITHOUT: run(False)}
    return Measured(particles, truth, {name: values for name, (_, values) in found.items()},
                    {name: outline for name, (outline, _) in found.items()})


def _shaken(recipe: Recipe, positions: Points, sizes: Floats | float, rng: Rng) -> Points:
    return positions + recipe.noise * np.reshape(sizes, (-1, 1)) * rng.standard_normal(positions.shape)


def _disc(x: float, y: float, radius: float) -> Any:
    return Polygon(ellipse_ring((x, y), radius, radius, 0, (8 * _CHORD * radius) ** 0.5))


def _sampled(region: Any, seed: int, rng: Rng) -> Points:
    """Particles of spacing 1 in a Shapely polygon."""
    return SAMPLERS[("relaxed", "settled")[seed % 2]](Curve(Outline.of_shapely(region), 1.0), False, rng)


# Sizes. Lengths are in root mean squares of the particles' sizes.

def _of_two(large: float, share: float) -> Draw:
    """Sizes `large` and 1. share: the share of the area that the large particles have."""
    chance = share / (share + (1 - share) * large ** 2)
    return lambda rng, points: np.where(rng.random(len(points)) < chance, large, 1.0)


def _uniform(largest: float) -> Draw:
    return lambda rng, points: rng.uniform(1, largest, len(points))


def _zones(rng: Rng, points: Points) -> Floats:
    """Sizes 1 at x > 0, and 2 elsewhere, with a quarter as many particles per area."""
    return np.where(points[:, 0] > 0, 1.0, np.where(rng.random(len(points)) < 0.25, 2.0, 0.0))


_DRAWS: dict[str, Draw] = {
    **{f"1:{ratio:g} uniform": _uniform(ratio) for ratio in (1.5, 3, 10)},
    **{f"1:{ratio:g} bidisperse": _of_two(ratio, 0.5) for ratio in (1.5, 3, 10)}, "2:1 zone": _zones}
_PARTICLES = 700


def _local_sizes(points: Points, particles: Points, sizes: Floats) -> Floats:
    """(M,) mean sizes of particles around points, weighted by the kernels of core/SIZES.md; 1 outside all kernels."""
    square = ((points[:, None] - particles) ** 2).sum(axis=-1) / (9 * sizes ** 2)
    weights = np.maximum(0, 1 - square) ** 3
    total = weights.sum(axis=1)
    return np.where(total > 0, weights @ sizes / np.maximum(total, 1e-300), 1.0)


def _sizes(recipe: Recipe, rng: Rng) -> Measured:
    truth = make_shape(recipe.shape, _PARTICLES, 0.25)
    region = Curve(truth, 1.0)
    rest, sizes = fill_sizes(region, _DRAWS[recipe.kind], rng)
    positions = _shaken(recipe, rest, sizes, rng)

    def run(own: bool) -> tuple[Outline, dict[str, float]]:
        outline = outline_of(_reconstruct(positions, spacing=1, volumes=sizes ** 2, sizes="own" if own else "equal"))
        curve = Curve(outline, 1.0)
        both = [(target.nearest(points)[0] / _local_sizes(points, rest, sizes)).mean()
                for points, target in ((curve.samples.middles, region), (region.samples.middles, curve))]
        return outline, {"deviation": float(np.mean(both)), "area": abs(curve.measure / region.measure - 1)}
    return _with_and_without(positions, truth, run)


# Grains. Lengths are in diameters of the smallest grain.

def _grains(recipe: Recipe, rng: Rng) -> Measured:
    kind, ratio = recipe.kind.split(" 1:")
    diameters = float(ratio) ** rng.random(150 if kind == "pile" else 60)
    if kind == "pile":
        centers = pile_grains(diameters, 14 * float(ratio) ** 0.5, rng)
    elif kind == "loose":
        region = Curve(make_shape(recipe.shape, 250, 0.25), 1.0)
        centers, sizes = fill_sizes(region, lambda rng, points: float(ratio) ** rng.random(len(points)), rng)
        diameters = shrink_to_grains(centers, sizes)
    else:
        centers = spray_grains(diameters, rng)
    centers, diameters = centers / diameters.min(), diameters / diameters.min()
    radii = diameters / 2

    def run(as_grains: bool) -> tuple[Outline, dict[str, float]]:
        parameters: dict[str, Any] = {"spacing": float((diameters ** 2).mean()) ** 0.5}
        if as_grains:
            parameters = {"sizes": "own", "boundary": "grains"}
        outline = outline_of(_reconstruct(centers, volumes=diameters ** 2, **parameters))
        curve = Curve(outline, 1.0)
        distance, inside = curve.nearest(centers)[0], curve.contains(centers)
        values = {"cut": float(np.clip((radii - np.where(inside, distance, -distance)) / diameters, 0, 1).max())}
        if kind == "spray":
            values["lone area"] = float(np.abs(_areas_at(centers, outline) / (np.pi * radii ** 2) - 1).max())
        return outline, values
    discs = unary_union([_disc(*center, radius) for center, radius in zip(centers, radii)])
    return _with_and_without(centers, Outline.of_shapely(discs), run)


def _areas_at(points: Points, outline: Outline) -> Floats:
    """(N,) area of the ring around each point; 0 if there is none."""
    areas = np.zeros(len(points))
    for ring, area in zip(outline.rings(), outline.ring_areas):
        if area > 0:
            areas[Curve(Outline.of([ring]), 1.0).contains(points)] = area
    return areas


# Phases.

_MARGIN = 3.5  # Interfaces are measured at least this far inside the body, in spacings.


def _half_plane(x: float, y: float, angle: float) -> Any:
    """The left side of the line through (x, y) at this angle."""
    return affinity.translate(affinity.rotate(box(-99, 0, 99, 99), angle, origin=(0, 0), use_radians=True), x, y)


def _phase_regions(kind: str, center: Points, rng: Rng) -> list[Any]:
    """A region around `center` for each phase except the first. The first phase fills the rest of the body."""
    (x, y), angle = center, rng.uniform(0, 2 * np.pi)
    half = _half_plane(x, y, angle)
    if kind == "straight":
        return [half]
    if kind == "curved":
        return [_disc(x + 23 * np.cos(angle), y + 23 * np.sin(angle), 23)]
    if kind.startswith("drop of "):
        return [_disc(x, y, (int(kind.removeprefix("drop of ")) / np.pi) ** 0.5)]
    turn = {"sectors": 2 * np.pi / 3, "T": np.pi}[kind]
    other = _half_plane(x, y, angle + np.pi / 2 if kind == "T" else angle + turn)
    second = half if kind == "T" else half.difference(other)
    third = other.difference(half) if kind == "T" else other.difference(_half_plane(x, y, angle + 2 * turn))
    return [second, third]


def _phases(recipe: Recipe, rng: Rng) -> Measured:
    truth = make_shape(recipe.shape, 1400, 0.25)
    body, center = truth.to_shapely().simplify(_CHORD), rng.uniform(-1.5, 1.5, 2)
    parts = _phase_regions(recipe.kind, center, rng)
    regions = [body.difference(unary_union(parts)), *(body.intersection(part) for part in parts)]
    rest = [_sampled(region, recipe.seed, rng) for region in regions]
    labels = np.repeat(np.arange(len(rest)), [len(points) for points in rest])
    positions = _shaken(recipe, np.concatenate(rest), 1.0, rng)
    inner, known = body.buffer(-_MARGIN), Curve(Outline.of_shapely(regions[1]), 1.0)
    length = regions[1].boundary.intersection(inner).length

    def run(shared: bool) -> tuple[Outline, dict[str, float]]:
        results = (_reconstruct(positions, volumes=np.ones(len(labels)), attributes={"phase": labels}, spacing=1,
                                sections=[{"phase": k} for k in range(len(rest))]).sections if shared else
                   [_reconstruct(positions[labels == k], volumes=np.ones((labels == k).sum()), spacing=1)
                    for k in range(len(rest))])
        curves = [Curve(outline_of(result), 1.0) for result in results]
        values = {"deviation": compare(curves[1], known, 1.0, Curve(Outline.of_shapely(inner), 1.0).contains).mean,
                  "gap and overlap": _gap_and_overlap(curves, inner, length),
                  "area": float(max(abs(curve.measure / (labels == k).sum() - 1) for k, curve in enumerate(curves)))}
        if len(rest) > 2:
            values["junction"] = _junction_distance(curves, center)
        return Outline.of(ring for curve in curves for ring in curve.outline.rings()), values
    true_rings = (ring for region in regions for ring in Outline.of_shapely(region).rings())
    return _with_and_without(positions, Outline.of(true_rings), run)


def _gap_and_overlap(curves: Seq[Curve], inner: Any, length: float) -> float:
    """Mean width of gaps and overlaps of the curves, over interfaces of this length inside `inner`."""
    shapes = [curve.outline.to_shapely().buffer(0) for curve in curves]
    union = unary_union(shapes)
    excess = max(0.0, sum(shape.area for shape in shapes) - union.area)
    return float((excess + inner.difference(union).area) / length)


def _junction_distance(curves: Seq[Curve], center: Points) -> float:
    """How far the point that is nearest to all outlines is from the true junction."""
    points = np.concatenate([curve.outline.densified(0.05).points for curve in curves])
    points = points[norm(points - center) < 3]
    farthest = np.max([curve.nearest(points)[0] for curve in curves], axis=0)
    return float(norm(points[farthest.argmin()] - center))


# Walls.

_DROP_AREA, _RING_POINTS, _LAYER_DEPTHS = 400.0, 128, (0.5, 1.5)


def _drop(recipe: Recipe, rng: Rng) -> Measured:
    """A drop whose outline is an arc that meets a line at a known angle."""
    degrees = float(recipe.kind.removeprefix("drop at "))
    angle = np.radians(degrees)
    radius = (_DROP_AREA / (angle - np.sin(angle) * np.cos(angle))) ** 0.5
    place = Similarity.plane(rng.uniform(0, 2 * np.pi), shift=rng.uniform(-9, 9, 2))
    region = _disc(0, -radius * np.cos(angle), radius).intersection(box(-99, 0, 99, 99))
    positions = place(_shaken(recipe, _sampled(region, recipe.seed, rng), 1.0, rng))
    line, feet = place(np.array([(0.0, 0), (1, 0)])), place(radius * np.sin(angle) * np.array([(-1.0, 0), (1, 0)]))
    truth = Outline.of_shapely(region)
    known = Curve(truth.moved(place(truth.points)), 1.0)

    def run(at_wall: bool) -> tuple[Outline, dict[str, float]]:
        result = _reconstruct(positions, spacing=1, walls=[line] if at_wall else [])
        outline = outline_of(result)
        if at_wall:
            contacts, angles = outline.points[result.rings.contacts], np.degrees(result.rings.contact_angles)
        else:  # Contacts of a circle that the gauge fits to the outline above the wall.
            (x, y), (dx, dy) = line[0], line[1] - line[0]
            fit = result.rings.gauge("contact", x=x, y=y, dx=dx, dy=dy, reach=6)
            contacts = line[0] + np.outer([fit["start"], fit["end"]], line[1] - line[0])
            angles = np.array([fit["start_angle"], fit["end_angle"]])
        curve = Curve(outline, 1.0)
        free = compare(curve, known, 1.0, lambda points: place.inverse()(points)[:, 1] > 1)
        return outline, {"contact": float(norm(feet[:, None] - contacts).min(axis=1, initial=radius).mean()),
                         "angle": float(np.abs(angles - degrees).mean()) if len(angles) else ABSENT,
                         "foot": float(curve.nearest(feet)[0].mean()), "deviation": free.mean}
    return _with_and_without(positions, known.outline, run)


def _tank(recipe: Recipe, rng: Rng) -> Measured:
    """A tank, turned, half full of fluid with a level surface."""
    turn = rng.uniform(8, 20) * rng.choice([-1, 1])
    middle, is_round = rng.uniform(-5, 5, 2), recipe.kind.startswith("round")
    ring = ellipse_ring((0, 0), 14, 14, 0, 2 * np.pi * 14 / _RING_POINTS)
    tank = Polygon(ring) if is_round else box(-16, -11, 16, 11)
    tank = affinity.translate(affinity.rotate(tank, turn, origin=(0, 0)), *middle)
    level = middle[1] + rng.uniform(-1, 2)
    region = tank.intersection(box(-99, -99, 99, level))
    fluid = _shaken(recipe, _sampled(region, recipe.seed, rng), 1.0, rng)
    wall, truth = Curve(Outline.of_shapely(tank), 1.0), Curve(Outline.of_shapely(region), 1.0)
    positions = fluid
    known: dict[str, Any] = {"walls": [wall.outline.points]}
    if recipe.kind.endswith("of particles"):
        layers = np.concatenate([sample_curve(Outline.of_shapely(tank.buffer(depth, join_style=2)), 1.0).middles
                                 for depth in _LAYER_DEPTHS])
        positions = np.concatenate([fluid, layers])
        known = {"wall_phases": [2], "attributes": {"phase": np.repeat([1, 2], [len(fluid), len(layers)])}}
    corners = np.empty((0, 2)) if is_round else wall.outline.points
    corners = corners[corners[:, 1] < level - 3]

    def run(at_wall: bool) -> tuple[Outline, dict[str, float]]:
        outline = outline_of(_reconstruct(positions, spacing=1, **known) if at_wall else _reconstruct(fluid, spacing=1))
        curve = Curve(outline, 1.0)
        points = curve.samples.middles
        distance = wall.nearest(points)[0]
        along = (distance < 1) & (points[:, 1] < level - 3)
        along &= (norm(points[:, None] - corners) > 3).all(axis=1)
        height = np.where(wall.contains(points), distance, -distance)[along]
        values = {"offset": abs(float(height.mean())), "rms": float(height.std()),
                  "deviation": compare(curve, truth, 1.0).mean}
        return outline, values if is_round else {**values, "corner": float(curve.nearest(corners)[0].mean())}
    return _with_and_without(positions, truth.outline, run)


def _walls(recipe: Recipe, rng: Rng) -> Measured:
    return _drop(recipe, rng) if recipe.kind.startswith("drop") else _tank(recipe, rng)


# Periodic boxes.

def _across(recipe: Recipe, rng: Rng) -> Measured:
    """A disc across faces of the box, against the same disc in the middle."""
    length, region = np.array([52.0, 44.0]), _disc(0, 0, 11.5)
    points = _shaken(recipe, _sampled(region, recipe.seed, rng), 1.0, rng)
    center = np.where([True, recipe.kind == "across a corner"], 0, length / 2) + rng.uniform(-4, 4, 2)
    middle = _reconstruct(points + length / 2, spacing=1)

    def run(periodic: bool) -> tuple[Outline, dict[str, float]]:
        result = _reconstruct((points + center) % length, spacing=1,
                              box={"x": (0, length[0]), "y": (0, length[1])} if periodic else None)
        return outline_of(result), {
            "area": abs(result.area / middle.area - 1), "perimeter": abs(result.perimeter / middle.perimeter - 1),
            "bodies": abs(float((result.rings.outer_of < 0).sum()) - 1)}
    truth = Outline.of_shapely(affinity.translate(region, *center % length))
    return _with_and_without((points + center) % length, truth, run)


_SHEAR_FRAMES = 24


def _shear_flow(recipe: Recipe, rng: Rng) -> Measured:
    """Drops that a shear flow carries across faces of the box: x moves by y in all frames together."""
    length, heights = 50.0, np.array([-24.0, -12, 0, 12, 24])
    starts = np.stack([rng.uniform(-3, 3, 5) - heights / 2, heights], axis=1)
    drops = [start + _sampled(_disc(0, 0, 4.4), recipe.seed, rng) for start in starts]
    points = np.concatenate(drops)

    def at(places: Points, t: float) -> Points:
        moved = places + t * np.stack([places[:, 1], 0 * places[:, 1]], axis=1)
        return np.stack([moved[:, 0] % length, moved[:, 1]], axis=1)

    def run(periodic: bool) -> tuple[Outline, dict[str, float]]:
        stream = partiemc.Reconstructor(spacing=1, threads=1, box={"x": (0, length)} if periodic else None)
        seen: set[tuple[int, int]] = set()
        errors: list[tuple[float, float]] = []
        for t in np.linspace(0, 1, _SHEAR_FRAMES):
            result = stream.reconstruct(at(points, t), ids=np.arange(len(points)))
            outer = result.rings.outer_of < 0
            # A drop's height does not change.
            nearest = np.abs(result.rings.centroids[outer][:, 1, None] - heights).argmin(axis=1)
            seen.update(zip(result.rings.identities[outer].tolist(), nearest.tolist()))
            errors.append((abs(outer.sum() - 5.0), abs(result.area / len(points) - 1)))
        bodies, area = np.mean(errors, axis=0)
        return outline_of(result), {"area": float(area), "bodies": float(bodies), "new identities": len(seen) - 5.0}
    return _with_and_without(at(points, 1), Outline(), run)


def _layer(recipe: Recipe, rng: Rng) -> Measured:
    """A wavy layer across the whole periodic box, so that it is connected with its own image."""
    length, phases = 44.0, rng.uniform(0, 2 * np.pi, 2)
    x = np.linspace(0, length, 500)
    low, high = (height + rise * np.sin(2 * np.pi * x / length + phase)
                 for height, rise, phase in ((0, 1.5, phases[0]), (13, 2.5, phases[1])))
    edges = [np.stack([x, low], axis=1), np.stack([x, high], axis=1)]
    region = Polygon(np.concatenate([edges[0], edges[1][::-1]]))
    points = _shaken(recipe, _sampled(region, recipe.seed, rng), 1.0, rng)
    points = np.stack([points[:, 0] % length, points[:, 1]], axis=1)
    true_perimeter = sum(norm(np.diff(edge, axis=0)).sum() for edge in edges)

    def run(periodic: bool) -> tuple[Outline, dict[str, float]]:
        result = _reconstruct(points, spacing=1, volumes=np.full(len(points), region.area / len(points)),
                              box={"x": (0, length)} if periodic else None)
        left, right = (result.rings.heights_at(at) for at in (1e-3, length - 1e-3))
        cut_rings = np.unique(np.searchsorted(result.rings.offsets, result.rings.cuts, side="right"))
        return outline_of(result), {
            "area": abs(result.area / region.area - 1), "perimeter": abs(result.perimeter / true_perimeter - 1),
            "cut bodies": abs(len(cut_rings) - 1.0),
            "step at the face": float(np.abs(left - right).max()) if len(left) == len(right) > 0 else ABSENT}
    return _with_and_without(points, Outline.of_shapely(region), run)


def _periodic(recipe: Recipe, rng: Rng) -> Measured:
    return {"shear flow": _shear_flow, "layer": _layer}.get(recipe.kind, _across)(recipe, rng)


_GROUPS: dict[str, Callable[[Recipe, Rng], Measured]] = {
    "sizes": _sizes, "grains": _grains, "phases": _phases, "walls": _walls, "periodic": _periodic}
SETS = ("all", "smoke", *_GROUPS)
_FIRST_SEED = 52_000_000


def measure(recipe: Recipe) -> Measured:
    """Makes a scene and measures it with the feature and without it. Cost: about a second."""
    return _GROUPS[recipe.group](recipe, np.random.default_rng(recipe.seed))


def make_matter_set(name: str) -> list[Recipe]:
    """The recipes of a set of SETS: all groups, one of them, or one scene of each kind, at rest (smoke)."""
    plans: list[tuple[str, Seq[str], Seq[str], Seq[float], int]] = [  # Group, kinds, shapes, noises, seeds.
        ("sizes", tuple(_DRAWS), ("egg", "bean", "trapezoid"), (0, 0.15), 1),
        ("grains", [f"{kind} 1:{ratio}" for kind in ("pile", "loose", "spray") for ratio in (1, 3, 6)], ("clover",),
         (0,), 3),
        ("phases", ("straight", "curved", "drop of 254", "drop of 30", "sectors", "T"), ("egg",), (0, 0.1), 4),
        ("walls", (*(f"drop at {angle}" for angle in (30, 60, 90, 120, 150)), "tank", "round tank",
                   "tank of particles", "round tank of particles"), ("",), (0, 0.1), 4),
        ("periodic", ("across an edge", "across a corner", "layer"), ("",), (0, 0.1), 4),
        ("periodic", ("shear flow",), ("",), (0,), 4)]
    recipes: list[Recipe] = []
    smoke: list[Recipe] = []
    for group, kinds, shapes, noises, seeds in plans:
        for kind in kinds:
            for noise in noises:
                recipes += [Recipe(group, kind, shapes[k % len(shapes)], noise, _FIRST_SEED + 1000 * len(recipes) + k)
                            for k in range(len(shapes) * seeds)]
                smoke += recipes[-len(shapes) * seeds:][:noise == 0]
    return smoke if name == "smoke" else [recipe for recipe in recipes if name in ("all", recipe.group)]
