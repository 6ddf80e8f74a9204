"""One disturbance, level by level: where each engine loses what."""
