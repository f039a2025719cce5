"""Light from far away: daylight, the sun, pictures of the whole sphere."""
