"""The small worlds, which the rooms about the simulator share."""

from simulated import gl, made, renderer

__all__ = ["gl", "made", "renderer"]
