"""English for labels that describe pictures: words, statements and sentences."""
