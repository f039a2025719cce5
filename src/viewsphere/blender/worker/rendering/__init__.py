"""Pictures of the staged scene: renderers, passes, motion blur and the compositor."""
