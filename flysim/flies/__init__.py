"""The fly engine: images, cameras and a random generator in, a swarm of 3-D points out."""
