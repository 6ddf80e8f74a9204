"""What each flaw of a camera looks like."""
