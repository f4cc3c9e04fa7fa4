"""Training runs: tasks, losses, steps, checkpoints, validation and export."""
