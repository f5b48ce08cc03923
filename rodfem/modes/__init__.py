"""Motion of a rod in a perturbation, and its left-most modes."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.modes")
