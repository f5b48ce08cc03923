"""What the course of ``docs/course`` uses beside the public interface: forms by hand, pictures, answers."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.course")
