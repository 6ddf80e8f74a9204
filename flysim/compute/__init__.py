"""What the compiled kernels of all rooms need: compilation, its cache, vectors, random numbers. No vision."""
