"""The parts of streets, houses, trees and street furniture, and their common measures in metres from the middle of the road."""

ROAD = 3.25
"""Half the road's width, gutters included."""

KERB = 3.4
"""Back of the kerb stones, where the verge begins."""

PAVEMENT = (4.6, 6.3)
"""Inner and outer edge of the pavement."""

STEP = 0.1
"""Height of pavements, verges and gardens above the road."""

DROPPED = 0.025
"""Height of the kerb where a driveway crosses it."""

HALF_WIDTH, HALF_LENGTH = 30.0, 100.0
"""Distance at which a street's gardens end and the country begins."""

PLOT = 19.0
"""Width of one house's plot along the street."""
