"""Fixtures; every test is collective: all ranks run all tests in the same order."""

import gc
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from mpi4py import MPI

from rodfem import compat

gc.disable()  # destroying PETSc objects is collective: it must not happen on one rank earlier than on another


@pytest.hookimpl(tryfirst=True)  # before pytest selects by marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark values beyond ``few(number)``, none of them ``long``, as such, and as ``alone`` all without ``ranks``."""
    met: Counter[tuple[Path, str]] = Counter()
    for item in items:
        if not item.get_closest_marker("ranks"):
            item.add_marker(pytest.mark.alone)
        few, name = item.get_closest_marker("few"), getattr(item, "originalname", item.name)
        if few and not item.get_closest_marker("long"):
            met[item.path, name] += 1
            if met[item.path, name] > few.args[0]:
                item.add_marker(pytest.mark.long)


@pytest.fixture(autouse=True, scope="module")
def collect_garbage() -> Iterator[None]:
    """Destroy what a module has left behind, on all ranks together."""
    yield
    gc.collect()
    compat.destroy_garbage(MPI.COMM_WORLD)
    gc.freeze()  # what is left, in caches, is not looked through again after each of a hundred modules


@pytest.fixture
def few_loads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sweeps have a quarter of their loads, where what is at each of a hundred is not what is tested."""
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 26)


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """Empty folder that all ranks share."""
    yield Path(MPI.COMM_WORLD.bcast(str(tmp_path)))
    MPI.COMM_WORLD.barrier()
