"""The parts of the zoo's people: a skeleton, fields that are flesh and clothes, weights, and their actions."""
