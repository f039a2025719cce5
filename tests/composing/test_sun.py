"""The sun's place by date, time and place, against published values."""

import math

import pytest

from viewsphere.composing.scene.draws import sun_position


def test_the_example_of_nrel_s_algorithm():
    """Reda and Andreas, *Solar Position Algorithm for Solar Radiation Applications* (NREL/TP-560-34302), appendix A.5."""
    azimuth, elevation = sun_position("2003-10-17", 12 + 30 / 60 + 30 / 3600 + 7, 39.742476, -105.1786)
    assert azimuth == pytest.approx(194.34024, abs=0.005)
    assert elevation == pytest.approx(90 - 50.11162, abs=0.005)


def test_declination_and_equation_of_time():
    """Meeus, *Astronomical Algorithms*, examples 25.a and 28.b: 1992 October 13, 0h; declination and equation of time."""
    declination, equation = -7.78507, 13 + 42.6 / 60
    where_it_is_noon = (12 * 60 - equation) / 4
    azimuth, elevation = sun_position("1992-10-13", 0.0, 45.0, where_it_is_noon)
    refraction = 1.02 / 60 / math.tan(math.radians(37.4))
    assert azimuth == pytest.approx(180, abs=0.01)
    assert elevation == pytest.approx(45 + declination + refraction, abs=0.01)


@pytest.mark.parametrize(
    ("day", "hours", "latitude", "azimuth"),
    [
        ("2024-03-20", 6.0, 0.0, 90.0),  # equinox: rises in the east, at the equator ...
        ("2024-03-20", 18.2, 0.0, 270.0),  # ... sets in the west
        ("2024-06-20", 12.03, 52.0, 180.0),  # summer's noon: in the south of Europe's sky
        ("2024-12-21", 11.97, -35.0, 0.0),  # in the north of Africa's cape
    ],
)
def test_where_the_sun_is_at_turning_points(day, hours, latitude, azimuth):
    found, elevation = sun_position(day, hours, latitude, 0.0)
    assert abs((found - azimuth + 180) % 360 - 180) < 2.5
    assert elevation > -3


def test_solstice_heights_and_midnight_sun():
    assert sun_position("2024-06-20", 12.03, 51.5, 0)[1] == pytest.approx(90 - 51.5 + 23.44, abs=0.02)
    assert sun_position("2024-12-21", 11.97, 51.5, 0)[1] == pytest.approx(90 - 51.5 - 23.44, abs=0.1)
    assert sun_position("2024-06-20", 24.03, 75, 0)[1] == pytest.approx(75 - 90 + 23.44, abs=0.2)
    assert sun_position("2024-12-21", 12, 75, 0)[1] < 0


def test_hours_beyond_the_day_are_of_another_day():
    assert sun_position("2024-06-20", 26.5, 40, 20) == pytest.approx(sun_position("2024-06-21", 2.5, 40, 20), abs=1e-6)
    assert sun_position("2024-06-20", -3, 40, 20) == pytest.approx(sun_position("2024-06-19", 21, 40, 20), abs=1e-6)
