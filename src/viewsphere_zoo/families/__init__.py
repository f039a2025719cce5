"""The families of the zoo, one module a family, named as its file."""
