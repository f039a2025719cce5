"""Functions that several lens models use."""
