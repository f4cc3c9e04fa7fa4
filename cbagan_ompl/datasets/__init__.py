"""Training sets: reading, writing, importing and generating them, and their labels."""
