"""Many photographs whose depths are known, by every engine."""
