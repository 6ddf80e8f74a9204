"""Worlds as records: shapes, models, and the SDF reader that makes them. No pybullet here."""
