"""Reading of model files in a separate process with limits."""
