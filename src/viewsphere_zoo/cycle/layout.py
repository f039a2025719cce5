"""The side view: frame geometry as bicycle makers state it, and the points that follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from viewsphere_zoo.shapes.solids import Float, Solid


@dataclass(frozen=True)
class Geometry:
    """Frame geometry: lengths in metres, angles in degrees from the horizontal.

    drop: how far the bottom bracket is below the axles; fork_length: axle to crown; rake: the front axle's distance from
    the steering axis; seat_tube: bottom bracket to the tube's top; saddle: bottom bracket to the saddle's top, along the
    seat tube; tube: thickness of the frame's tubes, 1 is steel and 1.6 a fat aluminium frame.
    """

    wheelbase: float = 0.99
    chainstay: float = 0.412
    drop: float = 0.07
    head_angle: float = 73.0
    seat_angle: float = 73.5
    fork_length: float = 0.375
    rake: float = 0.045
    head_tube: float = 0.145
    seat_tube: float = 0.53
    saddle: float = 0.735
    tube: float = 1.0


@dataclass(frozen=True)
class Layout:
    """Points (3,) of a frame on wheels of this radius, metres, x = 0, steering straight ahead."""

    g: Geometry
    radius: float

    @property
    def bracket(self) -> Float:
        """Bottom bracket."""
        return np.array((0.0, 0.0, self.radius - self.g.drop))

    @property
    def rear_axle(self) -> Float:
        """Centre of the rear wheel."""
        return np.array((0.0, np.sqrt(self.g.chainstay**2 - self.g.drop**2), self.radius))

    @property
    def front_axle(self) -> Float:
        """Centre of the front wheel."""
        return self.rear_axle - (0.0, self.g.wheelbase, 0.0)

    @cached_property
    def steering(self) -> Float:
        """Unit vector up the steering axis."""
        a = np.radians(self.g.head_angle)
        return np.array((0.0, np.cos(a), np.sin(a)))

    @property
    def ahead(self) -> Float:
        """Unit vector perpendicular to the steering axis, towards the front."""
        return np.cross((1.0, 0.0, 0.0), self.steering)

    @property
    def crown(self) -> Float:
        """Top of the fork on the steering axis."""
        along = np.sqrt(self.g.fork_length**2 - self.g.rake**2)
        return self.front_axle - self.g.rake * self.ahead + along * self.steering

    def on_steerer(self, height: float) -> Float:
        """The point on the steering axis this far above the crown."""
        return self.crown + height * self.steering

    @property
    def head(self) -> tuple[Float, Float]:
        """Lower and upper end of the head tube."""
        return self.on_steerer(0.012), self.on_steerer(0.012 + self.g.head_tube)

    @cached_property
    def seat(self) -> Float:
        """Unit vector up the seat tube."""
        a = np.radians(self.g.seat_angle)
        return np.array((0.0, np.cos(a), np.sin(a)))

    def on_seat(self, height: float) -> Float:
        """The point on the seat tube's axis this far from the bottom bracket."""
        return self.bracket + height * self.seat

    def steered(self, solid: Solid, angle: float) -> Solid:
        """The solid turned about the steering axis, radians; positive turns the front wheel to the rider's left (+X)."""
        return Solid(self.steered_points(solid.vertices, angle), solid.triangles)

    def steered_points(self, points: Float, angle: float) -> Float:
        """Points (..., 3) turned about the steering axis (Rodrigues' formula)."""
        k, p = self.steering, points - self.crown
        c, s = np.cos(angle), np.sin(angle)
        along = (p @ k)[..., None] * k
        return self.crown + along + (p - along) * c + np.cross(k, p) * s
