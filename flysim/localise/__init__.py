"""Where the robot is, as its flies tell: hops between frames, and the path they are chained to. No truth is read."""
