"""The parts of a motorcycle: design, wheels, front, engine, bodywork, and a scooter's shell."""
