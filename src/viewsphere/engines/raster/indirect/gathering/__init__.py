"""Light gathered for the pixels of a picture, from patches of surfaces."""
