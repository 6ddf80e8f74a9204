"""Policies trained, in a folder that can be resumed."""
