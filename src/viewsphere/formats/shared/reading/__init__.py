"""Data sets of other tools on their way into a store or a recipe: pictures, poses, models, classes."""
