"""What mirrors and glass show."""
