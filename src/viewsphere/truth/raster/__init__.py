"""Which triangle every pixel shows, and how far away."""
