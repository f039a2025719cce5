"""The steps from light to a picture: sky, ground and weather around the objects, view transform, effects."""
