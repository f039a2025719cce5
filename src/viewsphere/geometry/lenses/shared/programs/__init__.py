"""Camera models of other programs, in terms of the lenses here."""
