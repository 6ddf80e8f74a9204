"""What may not get worse: baselines."""
