"""Reflections in mirrors, and the view through glass."""
