"""What the course of ``docs/course`` uses beside the public interface: forms by hand, pictures, answers."""

from rodfem import libraries  # noqa: F401, before all that computes
from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.course")
