"""The parts of a car: hull, greenhouse, wheels, lights and fittings."""
