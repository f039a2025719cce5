"""From light to a picture: view transforms, blending with a background, and what cameras do to pictures."""
