"""Points that stay on surfaces: where pictures show them."""
