"""What every room stands on: files written whole, folders, processes, figures with their intervals. No vision."""
