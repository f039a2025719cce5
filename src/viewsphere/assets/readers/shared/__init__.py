"""What several readers need: polygons, smoothing, numbers, XML."""
