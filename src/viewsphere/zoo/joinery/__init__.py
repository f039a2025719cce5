"""What chairs are built from: members, slabs and cushions, materials, and one module for each style."""
