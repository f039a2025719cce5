"""What several motions need."""
