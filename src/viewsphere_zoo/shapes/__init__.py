"""Building blocks that all families of the zoo share: solids, panels on surfaces, and their assembly into a Mesh."""
