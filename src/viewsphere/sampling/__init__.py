"""From a recipe to a plan: models, viewpoints, splits, backgrounds; recipe + index -> shot."""
