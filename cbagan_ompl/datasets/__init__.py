"""Training sets: their layout on disk, making new ones, and how noisy their labels are."""
