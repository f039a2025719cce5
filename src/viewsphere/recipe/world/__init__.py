"""Recipe fields about the world: scenes, layouts, lights, motion, weather and the finish of pictures."""
