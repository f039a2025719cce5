"""The common parts of household things: vessels, prints, screens, leaves."""
