"""The shading kernels, which turn samples into light."""
