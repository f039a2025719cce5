"""What several samplers need."""
