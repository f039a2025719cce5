"""Proofs of frames: rays, recomputed labels, repainted pictures."""
