"""Messages about invalid values: suggestions, and mistakes in recipes and in the specs of plug-ins."""
