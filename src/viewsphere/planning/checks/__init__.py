"""Checks and warnings of a plan, before anything is rendered."""
