"""The samples of a data set, read back, selected and watched."""
