"""The faults of ``python -m tests.mutations`` still have their places in the code, and tests that there are."""

from pathlib import Path

from mutations import FAULTS, planted

HOME = Path(__file__).parents[2]


def test_every_fault_has_a_place() -> None:
    assert len(FAULTS) >= 25
    for fault in FAULTS.values():
        assert planted((HOME / fault.file).read_text(), fault)
        assert all((HOME / test).exists() for test in fault.tests.split())
