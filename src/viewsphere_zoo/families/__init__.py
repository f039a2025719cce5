"""The families of the zoo: one module for each family, named like the family."""
