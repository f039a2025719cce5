"""Building blocks of models of data: numbers, frozen models, names of files."""
