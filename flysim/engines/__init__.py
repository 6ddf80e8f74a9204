"""The same job by other means: what a user would reach for in place of the flies."""
