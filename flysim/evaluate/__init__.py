"""Where estimates meet the truth, and nowhere else."""
