"""The import of other tools' data sets into a store or a recipe: pictures, poses, models, classes."""
