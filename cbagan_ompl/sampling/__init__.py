"""Heat maps and samplers of them. Knows nothing of OMPL or torch."""
