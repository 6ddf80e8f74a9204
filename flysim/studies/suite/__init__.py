"""Many worlds, figures pooled."""
