"""From a recipe to rows: models, viewpoints, splits, rigs; the samplers."""
