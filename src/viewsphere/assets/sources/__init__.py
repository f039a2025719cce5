"""Sources of models in public layouts, a module each: `shapenet:FOLDER`, `gso:FOLDER`. Users have the files."""
