"""The reader of SDF world files: strict, and nothing outside the world's folder is opened."""
