"""Synthetic sequences with exact truth, and the sets of them. A `Recipe` determines everything in a scene."""

import hashlib
from dataclasses import dataclass, field, replace
from typing import Any, Iterator, Sequence as Seq

import numpy as np
from numpy.typing import NDArray

from .geometry import Curve, Floats, Indices, Outline, Points, ellipse_ring
from .motions import Body, BodiesMotion, FlowMotion, InUnits, Motion, Shear, Similarity, SimilarityMotion
from .samplers import SAMPLERS, Rng, relax, shift_particles, throw_darts
from .shapes import CURVE_STEP, TUNING_SHAPES, VALIDATION_SHAPES, fits_lattice, make_shape


@dataclass
class Frame:
    """One frame, in world units. positions: (N, d). volumes: (N,) area (volume in space) of each particle. ids: (N,),
    the same for a particle in all frames. velocities: (N, d). truth: the true boundary, empty where it is unknown.
    area: of the true region; of recordings the sum of volumes, or 0."""
    time: float
    positions: Points
    volumes: Floats | None = None
    ids: NDArray[np.uint64] | None = None
    velocities: Points | None = None
    truth: Outline = field(default_factory=Outline)
    area: float = 0.0


@dataclass
class Sequence:
    """Frames in their order, and known facts about them.

    spacing: h with N h^2 = area of the first frame, world units; of recordings given or estimated. It is the unit of
    metrics. judged: whether the sequence counts in comparisons. whole: whether areas are compared (not if spray comes
    off). walls: (W, 2, 2), the ends of rigid straight walls. motion: None of recordings. truth_follows_motion: False if
    outlines appear or vanish.
    """
    name: str
    group: str
    shape: str
    sampler: str
    spacing: float
    frames: list[Frame]
    judged: bool = True
    whole: bool = True
    walls: Floats = field(default_factory=lambda: np.empty((0, 2, 2)))
    motion: Motion | None = None
    truth_follows_motion: bool = True


# Rigid motion per frame: shortest and longest shift in spacings, largest turn in radians.
PACES = {"drift": (0.05, 0.3, 0.01), "steady": (0.5, 3.0, 0.1), "leaps": (5.0, 30.0, 1.0),
         "still": (0.0, 0.0, 0.0), "turn": (0.0, 0.0, 0.1)}


@dataclass(frozen=True)
class Recipe:
    """A scene before it is made.

    group: the difficulty: rigid (motion only), noise (new in each frame), thinned, deformed (by a flow), topology
    (bodies merge or part), ragged, growth (by new particles). noise: standard deviation along each axis, in spacings.
    kept_share: share of the particles that is kept. backwards: in `topology`, bodies part instead of merging.
    """
    name: str
    group: str = "rigid"
    shape: str = "disc"
    seed: int = 1
    sampler: str = "relaxed"
    pace: str = "steady"
    particles: int = 1000
    frames: int = 8
    noise: float = 0.0
    kept_share: float = 1.0
    backwards: bool = False


_STRAIGHT_STEP = 0.25  # Distance of points on straight sides, in spacings, in scenes that do not bend them.
# Ranges of a flow: strain of a shear in a step, its wavelength over the body's size, angle of the vortex in a step.
_STRAIN, _WAVE, _VORTEX_ANGLE = (0.04, 0.10), (0.8, 1.6), (0.075, 0.15)
_AREA_GROWTH = 1.05    # Factor of the area from frame to frame.
_BODY_GAP, _BODY_DEPTH = 3.1, 7.3  # Bodies come from this gap and end this deep in each other, in spacings.

# Per set of bodies: size of the second body over the size of the first; half axis of the first body towards the second
# over its radius; sideways offset over the sum of both sizes; whether a third body comes from the opposite side.
_BODIES: dict[str, tuple[float, float, float, bool]] = {
    "discs": (0.8, 1, 0, False), "uneven-discs": (0.45, 1, 0.1, False),
    "glancing-discs": (0.9, 1, 0.5, False), "disc-chain": (0.7, 1, 0.15, True),
    "ellipses": (0.85, 1.3, 0, False), "uneven-ellipses": (0.5, 0.8, 0.1, False),
    "glancing-ellipses": (0.9, 0.75, 0.4, False), "ellipse-chain": (0.65, 1.25, 0.1, True),
    "pebbles": (0.7, 1.2, 0.08, False), "uneven-pebbles": (0.42, 1.1, 0.25, False),
    "glancing-pebbles": (0.85, 0.9, 0.42, False), "pebble-chain": (0.62, 0.85, 0.14, True)}
_TUNING_BODIES, _VALIDATION_BODIES = tuple(_BODIES)[:8], tuple(_BODIES)[8:]

# A scene in units of the spacing: for each frame its outline, its particles and their ids (None: 0, 1, ...); then the
# motion.
_Draft = tuple[list[tuple[Outline, Points, Indices | None]], Motion]


def _signed(rng: Rng, low: float, high: float) -> float:
    return rng.uniform(low, high) * (1 if rng.random() < 0.5 else -1)


def _unit_vector(rng: Rng) -> Floats:
    angle = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle)])


def _rigid_motion(pace: str, count: int, rng: Rng) -> Motion:
    near, far, turn = PACES[pace]
    steps, center = [], np.zeros(2)
    for _ in range(count):
        move = rng.uniform(near, far) * _unit_vector(rng)
        step = Similarity.plane(_signed(rng, turn / 4, turn))
        steps.append(replace(step, shift=center + move - step(center)))
        center = center + move
    return SimilarityMotion(steps)


def _flow_motion(size: float, rng: Rng) -> Motion:
    def shear() -> Shear:
        wavenumber = 2 * np.pi / (rng.uniform(*_WAVE) * size)
        return Shear(_unit_vector(rng), rng.uniform(*_STRAIN) / wavenumber, wavenumber, rng.uniform(0, 2 * np.pi))
    return FlowMotion((shear(), shear()), rng.uniform(0, 0.4) * size * _unit_vector(rng),
                      rng.uniform(0.4, 0.7) * size, _signed(rng, *_VORTEX_ANGLE))


def _moving(recipe: Recipe, rng: Rng) -> _Draft:
    flows = recipe.group == "deformed"
    outline = make_shape(recipe.shape, recipe.particles, CURVE_STEP if flows else _STRAIGHT_STEP)
    points = SAMPLERS[recipe.sampler](Curve(outline, 1.0), fits_lattice(recipe.shape), rng)
    if recipe.kept_share < 1:
        points = points[np.sort(rng.permutation(len(points))[:round(recipe.kept_share * len(points))])]
    if rng.random() < 2 / 3:  # Every third scene begins along the axes, as recordings do.
        turn = Similarity.plane(rng.uniform(0, 2 * np.pi))
        outline, points = outline.moved(turn(outline.points)), turn(points)
    motion = (_flow_motion(recipe.particles ** 0.5, rng) if flows
              else _rigid_motion(recipe.pace, recipe.frames - 1, rng))
    frames = [(outline, points)]
    for t in range(recipe.frames - 1):
        outline, points = outline.moved(motion.carry(t, outline.points)), motion.carry(t, points)
        frames.append((outline, points))
    return [(o, p + recipe.noise * rng.standard_normal(p.shape) if recipe.noise else p, None)
            for o, p in frames], motion


def _growing(recipe: Recipe, rng: Rng) -> _Draft:
    """The region swells around the origin. New particles are thrown where they fit. Then all settle by the rule of
    their sampler: darts stay, clumps are shifted, all others are relaxed."""
    outline = make_shape(recipe.shape, recipe.particles, _STRAIGHT_STEP)
    points = SAMPLERS[recipe.sampler](Curve(outline, 1.0), fits_lattice(recipe.shape), rng)
    motion = SimilarityMotion([Similarity.plane(scale=_AREA_GROWTH ** 0.5)] * (recipe.frames - 1))
    per_area = len(points) / outline.area  # Not exactly 1 for a lattice.
    frames: _Draft = [(outline, points, None)], motion
    for t in range(recipe.frames - 1):
        outline, points = outline.moved(motion.carry(t, outline.points)), motion.carry(t, points)
        region, missing = Curve(outline, 1.0), round(per_area * outline.area) - len(points)
        points = np.concatenate([points, throw_darts(region, missing, rng, others=points)])
        if recipe.sampler == "clumped":
            points = shift_particles(region, points, 1)
        elif recipe.sampler != "blue-noise":
            points = relax(region, points, 6)
        frames[0].append((outline, points, None))
    return frames


def _make_bodies(shape: str, area: float, steps: int, rng: Rng) -> BodiesMotion:
    """Two or three bodies whose areas sum to `area`. The others move towards the first."""
    second, stretch, sideways, third = _BODIES[shape]
    radius = (area / (np.pi * (1 + second ** 2 * (2 if third else 1)))) ** 0.5
    a, b, heading = radius * stretch, radius / stretch, rng.uniform(0, 2 * np.pi)
    drift = rng.uniform(0.1, 0.5) * _unit_vector(rng)
    bodies = [Body(a, b, heading, np.zeros(2), drift)]
    # All ellipses have the same orientation. In coordinates stretched along the axes of the ellipses they are circles,
    # which touch when their centres are `reach` apart.
    reach = 1 + second
    ahead = (reach ** 2 - (sideways * reach) ** 2) ** 0.5 * a
    for side, late in ((1, 1.0), (-1, 1.37))[:2 if third else 1]:
        axis = side * np.array([np.cos(heading), np.sin(heading)])
        across = sideways * reach * b * np.array([-axis[1], axis[0]])
        bodies.append(Body(a * second, b * second, heading, (ahead + _BODY_GAP * late) * axis + across,
                           drift - (_BODY_GAP + _BODY_DEPTH) / steps * axis))
    return BodiesMotion(bodies)


def _merging(recipe: Recipe, rng: Rng) -> _Draft:
    motion = _make_bodies(recipe.shape, recipe.particles, recipe.frames - 1, rng)
    if recipe.backwards:
        motion = BodiesMotion([replace(body, start=body.center(recipe.frames - 1), step=-body.step)
                               for body in motion.bodies])
    rings = [ellipse_ring((0, 0), body.a, body.b, body.angle, CURVE_STEP) for body in motion.bodies]
    samples = [SAMPLERS[recipe.sampler](Curve(Outline.of([ring]), 1.0), False, rng) for ring in rings]
    return [(motion.outline(t), *motion.particles(samples, t)) for t in range(recipe.frames)], motion


def make_scene(recipe: Recipe) -> Sequence:
    """Makes a scene. Everything in it, the world's unit and origin included, follows from the recipe. Cost: 0.1 s for
    1,000 particles; relaxed 0.6 s, relaxed by 100 rounds 1.5 s."""
    rng = np.random.default_rng(recipe.seed)
    scale = rng.choice([1.0, 0.01, 0.37, 25.0])
    units = Similarity.plane(scale=scale, shift=rng.uniform(0, 200) * scale * _unit_vector(rng))
    snapshots, motion = {"topology": _merging, "growth": _growing}.get(recipe.group, _moving)(recipe, rng)
    frames = []
    for t, (outline, points, ids) in enumerate(snapshots):
        area = outline.area * scale ** 2
        frames.append(Frame(float(t), units(points), np.full(len(points), area / len(points)),
                            (np.arange(len(points)) if ids is None else ids).astype(np.uint64),
                            truth=outline.moved(units(outline.points)), area=area))
    sampler = recipe.group if recipe.group in ("noise", "thinned") else recipe.sampler
    return Sequence(recipe.name, recipe.group, recipe.shape, sampler,
                    float(np.sqrt(frames[0].area / len(frames[0].positions))), frames,
                    judged=recipe.kept_share > 0.4, motion=InUnits(motion, units),
                    truth_follows_motion=recipe.group != "topology")


def digest(sequence: Sequence) -> str:
    """A hash, in 16 hexadecimal digits, of all positions relative to the first one, rounded to
    thousandths of a spacing, because libm differs between machines in its last bits."""
    total, origin = hashlib.sha256(), sequence.frames[0].positions[0]
    for frame in sequence.frames:
        total.update(np.rint((frame.positions - origin) / sequence.spacing * 1e3).astype("<i8").tobytes())
    return total.hexdigest()[:16]


_SAMPLERS = tuple(name for name in SAMPLERS if name != "ragged")  # Samplers of every kind of motion.
_COUNTS = (900, 600, 1400, 700, 2000, 1100, 3000, 500)
_NOISES, _SHARES = (0.05, 0.10, 0.20), (1.0, 0.8, 0.5, 0.3)
_Plan = Seq[tuple[str, Seq[str]]]


def _recipes(shapes: Seq[str], bodies: Seq[str], seed: int, plan: _Plan) -> Iterator[Recipe]:
    """plan: groups with the samplers of their sequences. Shapes follow each other through all sequences, so that no
    shape always has the same pace, count or sampler."""
    serial, next_shape = 0, 0
    for group, samplers in plan:
        for k, sampler in enumerate(samplers):
            shape, next_shape = shapes[next_shape % len(shapes)], next_shape + 1
            # The sampler "lattice" fills only shapes made of boxes, so other shapes are skipped. In the group
            # "topology" the bodies are ellipses, and their curves cut the lattice.
            while sampler == "lattice" and group != "topology" and not fits_lattice(shape):
                shape, next_shape = shapes[next_shape % len(shapes)], next_shape + 1
            count, noise, share = _COUNTS[(serial + k // 8) % 8], _NOISES[k % 3], _SHARES[k % 4]
            backwards = k // len(bodies) % 2 == 1
            changes: dict[str, tuple[str, dict[str, Any]]] = {
                "noise": (f"-{100 * noise:.0f}", {"noise": noise, "pace": "steady"}),
                "thinned": (f"-{100 * share:.0f}", {"kept_share": share, "particles": count + 600}),
                "topology": ("-split" if backwards else "-merge",
                             {"shape": bodies[k % len(bodies)], "backwards": backwards}),
                "growth": ("", {"particles": min(count, 2000)})}
            variant, change = changes.get(group, ("", {}))
            recipe = replace(Recipe("", group, shape, seed + serial, sampler, tuple(PACES)[k % 3], count), **change)
            yield replace(recipe, name=f"{group}-{recipe.shape}{variant}-{sampler}-{k}")
            serial += 1


def _full(rounds: int) -> _Plan:
    return [("rigid", _SAMPLERS * rounds), ("noise", ("relaxed",) * 9), ("thinned", ("relaxed",) * 12),
            ("deformed", _SAMPLERS * rounds), ("topology", _SAMPLERS * rounds), ("ragged", ("ragged",) * 9),
            ("growth", _SAMPLERS * rounds)]


_SMOKE = (("rigid", ["relaxed"]), ("noise", ["relaxed"]), ("thinned", ["relaxed"]), ("deformed", ["settled"]),
          ("topology", ["clumped"]), ("ragged", ["ragged"]), ("growth", ["hexagonal"]))
SETS = ("smoke", "tuning", "validation", "discs")


def make_set(name: str) -> list[Recipe]:
    """The recipes of a set of SETS. smoke: one small sequence for each group. tuning: every sampler on rigid, deformed,
    topology and growth, two seeds each, and noise, thinned, ragged; methods are chosen by these. validation: the same
    with other shapes, bodies and seeds, three seeds each; never used to choose methods. discs: discs and ellipses,
    relaxed by 30 and by 100 rounds, still and turning."""
    if name == "tuning":
        return list(_recipes(TUNING_SHAPES, _TUNING_BODIES, 91_000, _full(2)))
    if name == "validation":
        return list(_recipes(VALIDATION_SHAPES, _VALIDATION_BODIES, 73_640_000, _full(3)))
    if name == "smoke":
        return [replace(recipe, particles=500)
                for recipe in _recipes(TUNING_SHAPES, _TUNING_BODIES, 77_000, _SMOKE)]
    names = [(shape, sampler, pace, count) for shape in ("disc", "ellipse") for sampler in _SAMPLERS[:2]
             for pace in ("still", "turn") for count in (500, 1000, 1700, 3000)]
    return [Recipe(f"{shape}-{sampler}-{pace}-{count}", "rigid", shape, 310_000 + k, sampler, pace, count)
            for k, (shape, sampler, pace, count) in enumerate(names)]
