"""Proofs of frames: rays, labels computed again, pictures painted again."""
