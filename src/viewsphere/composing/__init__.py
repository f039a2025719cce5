"""From a row to a shot: the places and motions of things, the cameras, and the light."""
