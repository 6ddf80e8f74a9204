"""What a run leaves behind: its folder, its files, its figures and its recording."""
