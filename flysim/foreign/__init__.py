"""Files that somebody else wrote: what they may be is checked before anything parses them."""
