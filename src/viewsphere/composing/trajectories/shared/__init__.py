"""Poses, aims and shake that several trajectories share."""
