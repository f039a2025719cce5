"""Fields and checks that several kinds of lamps share."""
