"""Trains on pictures that are rendered on demand, without a disk: python train.py

The stand-in for a network learns the mean depth of a car's pixels from their number.
"""

from pathlib import Path

import numpy as np

import viewsphere as vs

frames = vs.render(Path(__file__).with_name("recipe.yaml"), shuffle=True)  # each loop over it is the next epoch
weight, bias, rate = 0.0, 0.0, 0.05

for epoch in range(2):
    errors = []
    for sample in frames:  # sample.rgb (H, W, 3) uint8, .depth (H, W) float32 metres, .instances (H, W) ids
        car = sample.instances == 1
        if not car.any():  # hidden, out of the picture, or an empty one: nothing to learn a depth from
            continue
        size, depth = np.log(car.mean()), np.log(sample.depth[car].mean())
        error = weight * size + bias - depth
        weight, bias = weight - rate * error * size, bias - rate * error
        errors.append(abs(error))
    print(f"epoch {epoch}: {len(errors)} frames, mean error {np.mean(errors):.3f}")
