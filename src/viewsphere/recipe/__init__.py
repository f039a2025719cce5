"""What a user writes: fields, distributions, files, mistakes."""
