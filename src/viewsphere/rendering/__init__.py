"""From light to a picture: sky, ground and weather around the things, the view transform, effects."""
