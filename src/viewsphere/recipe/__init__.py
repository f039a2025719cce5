"""Recipes as users write them: their fields, distributions and files, and error messages."""
