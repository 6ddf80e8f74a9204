"""Robots as records: a URDF read strictly, its links, joints, wheels and cameras."""
