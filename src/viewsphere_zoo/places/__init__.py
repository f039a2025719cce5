"""Places that ship with the zoo: layouts of its families, one module a place."""
