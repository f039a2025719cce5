"""The nouns: shot, camera, channel, sample. Plain data, no behaviour that touches the outside world."""
