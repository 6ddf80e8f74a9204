"""Where frames come from: a simulated drive, or frames that are there already."""
