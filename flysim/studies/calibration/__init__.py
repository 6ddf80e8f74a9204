"""Calibrations by images and by simulation: run, held against the truth, drawn, written."""
