"""Agents compared, as tables and pictures."""
