"""What is measured on purpose: how fast, against what was published, and beside the rivals."""
