"""What the things of a household are built and printed with: vessels, prints, screens, leaves."""
