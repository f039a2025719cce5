"""The parts of a backpack: cloth, straps and closures."""
