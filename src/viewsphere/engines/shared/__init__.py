"""Code that several engines share: lamps, passes, and arrangements of things. `blender` is the common code of three engines."""
