"""Groups of HDF5 files in memory: one reading for all rows, where each row would read a dozen small arrays."""

from __future__ import annotations

from typing import Any

import h5py


class Loaded(dict[str, Any]):
    """Entries of a group by name, arrays and groups alike; ``attrs``, ``name`` and ``file`` are those of the group."""

    def __init__(self, group: Any) -> None:
        """Read a group and all below it."""
        super().__init__({name: Loaded(x) if isinstance(x, h5py.Group) else x[()] for name, x in group.items()})
        self.attrs, self.name, self.file = dict(group.attrs), group.name, group.file
