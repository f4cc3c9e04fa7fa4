"""Heat maps and the samples drawn from them. Knows nothing of OMPL or torch."""
