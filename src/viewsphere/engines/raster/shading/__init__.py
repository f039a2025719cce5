"""From samples to light: the kernels that paint."""
