"""Methods that determine stability: the inertia of the saddle matrix, and the spectrum of the singular pencil."""

from rodfem.lazy import attributes

__getattr__ = attributes(__name__)
