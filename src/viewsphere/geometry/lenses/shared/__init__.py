"""What several lens models share."""
