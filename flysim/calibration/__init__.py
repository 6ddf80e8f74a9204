"""What a board of known size, shown to one camera or two, tells of them, and images made straight by it."""
