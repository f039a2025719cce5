"""The nouns: recipe, shot, camera, channel, sample. Plain data, no behaviour that touches the outside world."""
