"""Loci of special points in the plane of two parameters: boundaries of stability."""

from rodfem.lazy import attributes

__getattr__ = attributes(__name__)
