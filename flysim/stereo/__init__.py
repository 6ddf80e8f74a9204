"""The geometry of a pair: windows, how they map from eye to eye, the step that refines a depth. No evolution."""
