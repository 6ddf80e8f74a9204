"""Engines side by side on one drive."""
