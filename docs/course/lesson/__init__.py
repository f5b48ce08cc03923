"""What the lessons use beside rodfem's public interface: forms by hand, pictures, right answers."""

from rodfem import libraries  # noqa: F401, before all that computes
