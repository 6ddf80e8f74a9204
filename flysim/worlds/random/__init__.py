"""Worlds drawn at random, of a difficulty, and written as SDF."""
