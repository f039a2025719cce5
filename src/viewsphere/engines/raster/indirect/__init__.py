"""Light between surfaces: radiosity patches, final gather, irradiance volumes."""
