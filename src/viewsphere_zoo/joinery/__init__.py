"""The parts of chairs: members, slabs and cushions, materials, and one module for each style."""
