"""How the points of a scene move from one frame to the next, exactly.

A motion maps points (N, d) of frame t to where they are in frame t + 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Sequence

import numpy as np
from shapely.geometry import Polygon
from shapely.ops import unary_union

from .geometry import Floats, Indices, Outline, Points, cross, dot, ellipse_ring, norm
from .shapes import CURVE_STEP


class Motion(Protocol):
    def carry(self, frame: int, points: Points) -> Points:
        """Positions in frame `frame + 1` of the points of frame `frame`, (N, d)."""


@dataclass(frozen=True)
class Similarity:
    """p -> matrix p + shift; matrix (d, d) is a rotation times a scale."""
    matrix: Floats
    shift: Floats

    @staticmethod
    def plane(angle: float = 0.0, scale: float = 1.0, shift: Sequence[float] = (0.0, 0.0)) -> Similarity:
        cosine, sine = scale * np.cos(angle), scale * np.sin(angle)
        return Similarity(np.array([[cosine, -sine], [sine, cosine]]), np.asarray(shift, float))

    def __call__(self, points: Points) -> Points:
        return np.asarray(points @ self.matrix.T + self.shift)

    def inverse(self) -> Similarity:
        matrix = np.linalg.inv(self.matrix)
        return Similarity(matrix, -matrix @ self.shift)


@dataclass(frozen=True)
class SimilarityMotion:
    """Rigid motions and dilations: steps[t] maps frame t to frame t + 1."""
    steps: list[Similarity]

    def carry(self, frame: int, points: Points) -> Points:
        return self.steps[frame](points)


@dataclass(frozen=True)
class Shear:
    """Moves points along a unit vector by amplitude * sin(wavenumber * position across + phase)."""
    along: Floats
    amplitude: float
    wavenumber: float
    phase: float


@dataclass(frozen=True)
class FlowMotion:
    """Incompressible flow of the plane, the same in every step: two shears and a vortex, each of which keeps areas
    exactly. The vortex turns points within `radius` of `center`, by `angle` at its centre."""
    shears: tuple[Shear, Shear]
    center: Floats
    radius: float
    angle: float

    def carry(self, frame: int, points: Points) -> Points:
        for shear in self.shears:
            wave = np.sin(shear.wavenumber * cross(shear.along, points) + shear.phase)
            points = points + (shear.amplitude * wave)[:, None] * shear.along
        arm = points - self.center
        # The angle depends only on the distance from the centre, so each circle around the centre turns as a whole.
        turn = self.angle * np.maximum(0, 1 - dot(arm, arm) / self.radius ** 2) ** 2
        cosine, sine = np.cos(turn), np.sin(turn)
        return self.center + np.stack([cosine * arm[:, 0] - sine * arm[:, 1],
                                       sine * arm[:, 0] + cosine * arm[:, 1]], axis=1)


@dataclass(frozen=True)
class Body:
    """An ellipse on a straight path: half axes a and b, the first turned by `angle` radians; centre in frame 0 and
    its movement in each step, (2,)."""
    a: float
    b: float
    angle: float
    start: Floats
    step: Floats

    def center(self, frame: int) -> Floats:
        return self.start + frame * self.step

    def distance(self, frame: int, points: Points) -> Floats:
        """(N,) distances from the ellipse, negative inside: exact to first order near the boundary. The sign is exact
        everywhere."""
        axes = np.array([self.a, self.b])
        q = Similarity.plane(-self.angle)(points - self.center(frame)) / axes
        radius = np.maximum(norm(q), 1e-12)  # 1 on the ellipse.
        return np.asarray((radius - 1) * radius / np.maximum(norm(q / axes), 1e-300))


@dataclass(frozen=True)
class BodiesMotion:
    """Each point moves with the body whose boundary is nearest."""
    bodies: list[Body]

    def carry(self, frame: int, points: Points) -> Points:
        nearest = np.stack([np.abs(body.distance(frame, points)) for body in self.bodies]).argmin(axis=0)
        return np.asarray(points + np.stack([body.step for body in self.bodies])[nearest])

    def outline(self, frame: int) -> Outline:
        """The boundary of the union of all bodies."""
        return Outline.of_shapely(unary_union([
            Polygon(ellipse_ring(body.center(frame), body.a, body.b, body.angle, CURVE_STEP))
            for body in self.bodies]))

    def particles(self, samples: Sequence[Points], frame: int) -> tuple[Points, Indices]:
        """The particles of the union, (N, 2), and their ids, (N,). samples[k]: the particles of
        body k, relative to its centre. Where bodies overlap, only the first of them keeps its
        particles. An id is the index of a particle in all samples, one body after the other."""
        moved = [body.center(frame) + points for body, points in zip(self.bodies, samples)]
        free = [np.all([before.distance(frame, points) >= 0 for before in self.bodies[:k]], axis=0)
                & np.ones(len(points), np.bool_) for k, points in enumerate(moved)]
        kept = np.flatnonzero(np.concatenate(free))
        return np.concatenate(moved)[kept], kept


@dataclass(frozen=True)
class InUnits:
    """A motion in other units: point p of `motion` is point units(p) of this motion."""
    motion: Motion
    units: Similarity

    def carry(self, frame: int, points: Points) -> Points:
        return self.units(self.motion.carry(frame, self.units.inverse()(points)))
