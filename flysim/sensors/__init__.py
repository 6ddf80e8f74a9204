"""What a real pair of cameras does to what was drawn, and what a robot wrongly believes of its cameras."""
