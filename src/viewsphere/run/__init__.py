"""From a recipe to samples in memory or a data set on disk: tasks, executors, exports."""
