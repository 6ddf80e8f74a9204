"""What one room hands to the next: frames, swarms, clouds, obstacles, findings. Nouns only."""
