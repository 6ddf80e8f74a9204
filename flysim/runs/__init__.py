"""Scenarios, and running them: the rooms wired together."""
