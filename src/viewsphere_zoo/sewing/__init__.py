"""The parts of a backpack: cloth, what it is carried by, how it closes."""
