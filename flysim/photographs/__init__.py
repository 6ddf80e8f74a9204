"""Pairs that real cameras took: what a user names, made level, its depths, its floor, and what is wrong with it."""
