"""Stops planned from a world's file: free of collision, and where they see what stands there. No simulator here."""
