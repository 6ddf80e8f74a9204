"""Data sets in and out: frames with their truth as folders that other programs read, and those of others read."""
