"""The simulated robot in its world: the only rooms that know pybullet."""
