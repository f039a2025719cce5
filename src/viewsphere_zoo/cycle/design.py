"""The parameters of a whole bicycle, and one of each style."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from viewsphere_zoo.cycle.brakes import Brake
from viewsphere_zoo.cycle.coats import Colors
from viewsphere_zoo.cycle.cockpit import Cockpit
from viewsphere_zoo.cycle.cranks import Pedal
from viewsphere_zoo.cycle.fittings import Basket
from viewsphere_zoo.cycle.forks import Fork
from viewsphere_zoo.cycle.frames import Frame
from viewsphere_zoo.cycle.gears import Gears
from viewsphere_zoo.cycle.layout import Geometry
from viewsphere_zoo.cycle.saddle import Saddle
from viewsphere_zoo.cycle.wheels import Wheel
from viewsphere_zoo.shapes.paint import Color

Style = Literal["road", "mountain", "step_through"]


@dataclass(frozen=True)
class Bicycle:
    """Parameters of a bicycle; lengths in metres, angles in degrees, colours sRGB 0..1.

    steering: positive turns the front wheel to the rider's left; crank: length; crank_angle: of the right crank, 0 forward,
    90 up; crank_arms: of the spider; brake: caliper and v on the rim, disc (the wheel's rotor), hub (invisible);
    guards: mudguards in the frame's colour, in the colour `extra`, or none; panniers: bags on the carrier; bottles: on the down
    tube, then on the seat tube; lights: in front and, without a carrier, on the rear mudguard or the seat post; dynamo: in the
    front hub.
    """

    style: Style = "road"
    geometry: Geometry = field(default_factory=Geometry)
    wheel: Wheel = field(default_factory=Wheel)
    frame: Frame = field(default_factory=Frame)
    fork: Fork = "straight"
    gears: Gears = field(default_factory=Gears)
    cockpit: Cockpit = field(default_factory=Cockpit)
    saddle: Saddle = field(default_factory=Saddle)
    brake: Brake = "caliper"
    steering: float = 0.0
    crank: float = 0.1725
    crank_angle: float = 20.0
    crank_arms: int = 5
    pedal: Pedal = "clipless"
    colors: Colors = field(default_factory=Colors)
    canvas: Color = (0.12, 0.13, 0.15)
    guards: Literal["none", "frame", "extra"] = "none"
    carrier: bool = False
    panniers: int = 0
    basket: Basket = "none"
    lights: bool = False
    dynamo: bool = False
    bottles: int = 1
    saddle_bag: bool = False
    frame_bag: bool = False
    kickstand: bool = False


_RUBBER: Color = (0.09, 0.09, 0.095)
STYLES: dict[Style, Bicycle] = {
    "road": Bicycle(),
    "mountain": Bicycle(
        style="mountain",
        geometry=Geometry(1.15, 0.437, 0.038, 67.5, 74.0, 0.51, 0.046, 0.112, 0.43, 0.71, 1.6),
        wheel=Wheel(tyre=0.058, rim_width=0.03, rim_depth=0.02, spokes=32, spoke=0.00125, knobs=True, rotor=0.09, braked=False),
        frame=Frame(bridge=False),
        fork="telescopic",
        gears=Gears((32,), (11, 13, 15, 18, 21, 24, 28, 34, 42, 50), 4, 0.053, 0.088),
        cockpit=Cockpit("riser", 0.76, 0.055, 4.0, 0.02),
        saddle=Saddle(0.275, 0.145, 0.048),
        brake="disc",
        crank_arms=4,
        pedal="platform",
        colors=Colors(frame=(0.1, 0.32, 0.62), fork=(0.08, 0.08, 0.085), rim=(0.08, 0.08, 0.085), parts=(0.12, 0.12, 0.125)),
    ),
    "step_through": Bicycle(
        style="step_through",
        geometry=Geometry(1.1, 0.455, 0.065, 69.0, 70.5, 0.408, 0.058, 0.2, 0.46, 0.665, 1.1),
        wheel=Wheel(tyre=0.042, rim_width=0.028, rim_depth=0.018, spokes=36, braked=False, reflectors=2),
        frame=Frame("swan", "plain"),
        fork="raked",
        gears=Gears((38,), (18,), 0, 0.0475, guard="half"),
        cockpit=Cockpit("swept", 0.58, 0.07, 10.0, 0.09, quill=True, bell=True),
        saddle=Saddle(0.265, 0.2, 0.06, springs=True),
        brake="v",
        crank=0.17,
        pedal="rubber",
        colors=Colors(frame=(0.16, 0.4, 0.36), fork=(0.16, 0.4, 0.36), saddle=(0.4, 0.22, 0.12), grip=(0.4, 0.22, 0.12)),
        guards="frame",
        carrier=True,
        basket="wicker",
        lights=True,
        dynamo=True,
        bottles=0,
        kickstand=True,
    ),
}
"""One bicycle of each style."""
