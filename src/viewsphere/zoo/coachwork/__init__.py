"""What a car is built from: hull, greenhouse, wheels, lights and fittings."""
