"""From flies to obstacles: clusters with a place, a heading and dimensions."""
