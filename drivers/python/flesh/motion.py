"""motion.py: motions and amplitudes in time, and the obstacles that a body cannot enter."""
from typing import NamedTuple

import numpy as np

from ._arrays import doubles, integers, pointer
from ._callbacks import Const, Handle, call, create, owned
from ._library import ffi, lib
from .errors import ArgumentError

__all__ = ["Motion", "Amplitude", "Obstacle", "Triangles"]


class Triangles(NamedTuple):
    """A surface of triangles."""
    positions: np.ndarray  # [nodes, 3] m
    corners: np.ndarray  # [triangles, 3]


class Motion(Const):
    """A motion by keyframes: x(t) = centre + R(t) (X - centre) + translation(t).

    Args:
        keyframes: rows (t, translation [3] m) or (t, translation [3] m, rotation vector [3] rad), t in s ascending.
            For a spring's target the translation is its position.
        centre: [3] m, centre of the rotations.
        smooth: cubic easing, at rest at every keyframe, instead of linear interpolation.
    """

    def __init__(self, keyframes, centre=(0, 0, 0), smooth=False):
        rows = [tuple(row) if len(row) == 3 else (*row, (0, 0, 0)) for row in keyframes]
        if any(len(row) != 3 for row in rows):
            raise ArgumentError("a keyframe must be (t, translation) or (t, translation, rotation)")
        self._frames = ffi.new("flesh_keyframe[]", max(len(rows), 1))
        for frame, (t, translation, rotation) in zip(self._frames, rows):
            frame.t = t
            frame.translation = list(doubles(translation, (3,), "translation"))
            frame.rotation = list(doubles(rotation, (3,), "rotation"))
        self._struct = ffi.new("flesh_motion *", {"count": len(rows), "keyframes": self._frames,
                                                  "centre": list(doubles(centre, (3,), "centre")),
                                                  "smooth": bool(smooth)})

    @classmethod
    def fixed(cls, place) -> "Motion":
        """Returns a motion that stays at `place` [3], m."""
        return cls([(0, place)])


class Amplitude(Const):
    """Amplitude of a load: a factor interpolated between points, constant before the first and after the last.

    Args:
        points: rows (t, value), t in s ascending; none: 1.
        smooth: cubic easing between them.
        start, until: s; the load acts while start <= t < until.
    """

    def __init__(self, points=(), smooth=False, start: float = -np.inf, until: float = np.inf):
        rows = doubles(points, (None, 2), "points") if np.size(points) else ()
        self._points = ffi.new("flesh_curve_point[]", [tuple(row) for row in rows] or 1)
        self._struct = ffi.new("flesh_amplitude *", {"count": len(rows), "points": self._points,
                                                     "smooth": bool(smooth), "from": start, "until": until})


class Obstacle(Handle):
    """A region that a body cannot enter. Made by `plane`, `sphere`, `capsule` or `mesh`; a contact takes ownership.

    Raises:
        ArgumentError: a number that is not finite, a radius that is not positive, a normal that is zero.
    """

    def __init__(self):
        raise ArgumentError("an obstacle is made by Obstacle.plane, .sphere, .capsule or .mesh")

    @classmethod
    def _make(cls, function, *arguments):
        made = cls.__new__(cls)
        made._pointer = owned("flesh_obstacle", create("flesh_obstacle", function, *arguments),
                              lib.flesh_obstacle_destroy)
        made._owner = None
        return made

    @classmethod
    def _of(cls, pointer_, owner):
        made = cls.__new__(cls)
        made._pointer, made._owner = pointer_, owner
        return made

    @classmethod
    def plane(cls, point, normal) -> "Obstacle":
        """Makes the half-space below a plane through `point` [3] m, whose `normal` [3] points towards the body."""
        return cls._make(lib.flesh_obstacle_plane, pointer(doubles(point, (3,), "point")),
                         pointer(doubles(normal, (3,), "normal")))

    @classmethod
    def sphere(cls, centre, radius) -> "Obstacle":
        """Makes a ball: centre [3] and radius in m."""
        return cls._make(lib.flesh_obstacle_sphere, pointer(doubles(centre, (3,), "centre")), float(radius))

    @classmethod
    def capsule(cls, a, b, radius) -> "Obstacle":
        """Makes the set of all points closer than `radius` m to the segment from a [3] to b [3] m."""
        return cls._make(lib.flesh_obstacle_capsule, pointer(doubles(a, (3,), "a")), pointer(doubles(b, (3,), "b")),
                         float(radius))

    @classmethod
    def mesh(cls, positions, triangles) -> "Obstacle":
        """Makes a surface: positions [nodes, 3] m, triangles [triangles, 3]; both sides are obstacles."""
        x = doubles(positions, (None, 3), "positions")
        corners = integers(triangles, (None, 3), "triangles")
        return cls._make(lib.flesh_obstacle_mesh, len(x), pointer(x), len(corners), pointer(corners, "int"))

    def move(self, motion: Motion) -> "Obstacle":
        """Makes the obstacle follow a motion; returns itself. Call it before a contact takes the obstacle."""
        if self._owner is not None:
            raise ArgumentError("a contact has taken this obstacle; let it move before that")
        call(lib.flesh_obstacle_move, self._pointer, motion._struct)
        return self

    def _give(self, owner):
        """Returns the pointer for a function that takes ownership; from then on it is `owner`'s."""
        if self._owner is not None:
            raise ArgumentError("a contact has taken this obstacle already; each needs its own")
        pointer_ = self._pointer
        ffi.gc(pointer_, None)
        self._owner, self._pointer = owner, ffi.NULL
        return ffi.new("flesh_obstacle **", pointer_)

    def surface(self, t=0.0, centre=(0, 0, 0), extent=1.0) -> Triangles:
        """Returns triangles at time t s, for pictures; a plane is a square of side 2*extent m around `centre`."""
        made = owned("flesh_surface", create("flesh_surface", lib.flesh_obstacle_surface, self._pointer, float(t),
                                             pointer(doubles(centre, (3,), "centre")), float(extent)),
                     lib.flesh_surface_destroy)
        vertices, faces = lib.flesh_surface_vertex_count(made), lib.flesh_surface_face_count(made)
        x = np.frombuffer(ffi.buffer(lib.flesh_surface_positions(made), 24 * vertices), np.float64)
        triangles = np.frombuffer(ffi.buffer(lib.flesh_surface_corners(made), 12 * faces), np.intc)
        return Triangles(x.reshape(-1, 3).copy(), triangles.reshape(-1, 3).copy())
