"""Samples along edges, and larger pictures for supersampling."""
