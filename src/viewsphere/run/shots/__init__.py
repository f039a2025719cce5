"""From rows to samples: shots composed, stages kept warm, cameras checked, views reconstructed."""
