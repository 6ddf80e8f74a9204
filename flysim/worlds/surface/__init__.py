"""What bodies are drawn with: triangles and textures."""
