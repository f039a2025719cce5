"""The camera behind a picture: from scene-linear light to the digital numbers of a sensor, and from these to a picture.

In the order of the light path:

1. `metering`: exposure, ISO and white balance, if they are automatic. After it, light of 1 saturates green.
2. Smoother, and effects of the stages `objects` and `lens`.
3. `optics`: lateral chromatic aberration, vignetting, flare, bloom.
4. `sensor`: colour filters, photon noise, full well, read noise, gain, black level, converter: the channel `bayer`. Then
   black level, white balance, demosaicing, colour matrix: a display-linear picture.
5. Effects of the later stages, and the sRGB curve.
"""
