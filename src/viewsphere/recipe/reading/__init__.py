"""Recipe files: YAML, recipes that extend others, former names and the places of errors."""
