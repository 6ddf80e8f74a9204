"""What the compiled kernels of all rooms need: compilation, its cache, threads, vectors, random numbers. No vision."""
