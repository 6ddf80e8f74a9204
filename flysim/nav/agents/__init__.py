"""Who drives: agents that map an observation to an action."""
