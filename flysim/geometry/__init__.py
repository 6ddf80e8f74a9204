"""Frames, cameras and stereo geometry: numpy in, numpy out."""
