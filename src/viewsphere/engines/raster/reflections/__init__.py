"""The reflections in mirrors and the view through glass."""
