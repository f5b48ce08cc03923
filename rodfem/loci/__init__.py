"""Loci of special points in the plane of two parameters: boundaries of stability."""
