"""Calibration files of stereo cameras, one format a file, all read into one record."""
