"""Code that several readers need: polygons, smoothing, numbers, XML."""
