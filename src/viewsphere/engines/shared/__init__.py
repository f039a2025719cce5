"""Code that several engines share: lamps, passes, and arrangements of things; `blender` is all of three engines."""
