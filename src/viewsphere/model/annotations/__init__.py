"""Facts about models and objects: points, symmetries, classes, metadata, voxels."""
