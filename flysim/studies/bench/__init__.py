"""How fast: the engine, the environment, a stop."""
