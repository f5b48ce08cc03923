"""Enough digits: error bars, graded meshes, an accuracy kept along a branch."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.adaptivity")
