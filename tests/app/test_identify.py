"""Constants from what was measured, of closed forms with and without noise."""

from math import pi
from pathlib import Path

import classics
import numpy as np
import pytest

import rodfem
from rodfem import Field, Ordinate, Scene, clamped, free
from rodfem.errors import ConvergenceError, InputError
from rodfem.forms.energy import bending_and_twist


def arc() -> Scene:
    """A strip with a natural curvature K in its plane, bent by a couple M and pushed across by a force F."""
    return classics.column(
        "arc", (clamped(), free(force=lambda c: (0.0, c.F, 0.0), moment=lambda c: (c.M, 0.0, 0.0))), (0.0, 3.0),
        load="M", constants={"M": 0.0, "B": 1.0, "K": 0.0, "F": 0.0}, planar="e1",
        energy=lambda v, k, c: bending_and_twist((k[0] - c.K, k[1], k[2]), (c.B, 1.0, 1.0)),
        ordinate=Ordinate("deflection", s=1.0, of=lambda r, q: r[1]),
    )  # fmt: skip


def deflection(k: np.ndarray) -> np.ndarray:
    """Of the end of a circle of curvature k."""
    return -(1 - np.cos(k)) / k


def test_stiffness_and_natural_curvature_from_a_curve() -> None:
    """k = M / B + K: exact data give B and K, and noise of 1e-3 errors of Gauss's theory, from the closed form."""
    M, B, K = np.linspace(0.2, 2.6, 7), 2.0, 0.4
    exact = deflection(M / B + K)
    found = rodfem.identify(arc(), {"ordinate": np.column_stack([M, exact])}, ("B", "K"))
    assert [found.values["B"], found.values["K"]] == pytest.approx([B, K], abs=1e-8)
    assert [point.index for point in found.points] == [0] * len(M)

    noisy = exact + 1e-3 * np.random.default_rng(3).standard_normal(len(M))
    again = rodfem.identify(arc(), {"ordinate": np.column_stack([M, noisy])}, ("B", "K"), {"ordinate": 1e-3})
    h = 1e-5
    slopes = np.column_stack(
        [
            (deflection(M / (B + h) + K) - deflection(M / (B - h) + K)) / (2 * h),
            (deflection(M / B + K + h) - deflection(M / B + K - h)) / (2 * h),
        ]
    )
    sigma = 1e-3 * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    assert [again.errors["B"], again.errors["K"]] == pytest.approx(sigma, rel=0.05)
    assert abs(again.values["B"] - B) < 3 * sigma[0] and abs(again.values["K"] - K) < 3 * sigma[1]


def test_standard_errors_are_those_of_repeated_measurements(tmp_path: Path) -> None:
    """Of 16 curves in files, with noise of a size that is not told, estimates scatter by as much as they say."""
    M, B, K = np.linspace(0.2, 2.6, 7), 2.0, 0.4
    noise, off, told = np.random.default_rng(5), [], []
    for _ in range(16):
        rows = np.column_stack([M, deflection(M / B + K) + 1e-3 * noise.standard_normal(len(M))])
        np.savetxt(tmp_path / "curve.csv", rows, delimiter=", ", header="couple, deflection")
        found = rodfem.identify(arc().varying(B=1.9, K=0.3), {"ordinate": tmp_path / "curve.csv"}, ("B", "K"))
        off.append([found.values["B"] - B, found.values["K"] - K])
        told.append([found.errors["B"], found.errors["K"]])
    assert 0.5 < np.mean(np.square(np.array(off) / told)) < 1.6  # of 32 squares, one but for a quarter
    with pytest.raises(InputError, match="give the path of a text file"):
        rodfem.identify(arc(), {"ordinate": tmp_path / "none.csv"}, ("B",))


def test_several_experiments_with_one_rod() -> None:
    """Each alone has one load and determines one constant: two have both."""
    rods, loads = [arc(), arc()], (0.6, 2.2)
    data = [{"ordinate": [[M, deflection(M / 2.0 + 0.4)]]} for M in loads]
    found = rodfem.identify(rods, data, ("B", "K"))
    assert [found.values["B"], found.values["K"]] == pytest.approx([2.0, 0.4], abs=1e-6) and len(found.points) == 2
    with pytest.raises(ConvergenceError, match="do not determine"):
        rodfem.identify(rods[0], data[0], ("B", "K"))
    with pytest.raises(InputError, match="2 scenes and 1 sets of data"):
        rodfem.identify(rods, data[:1], ("B",))


def test_natural_curvature_for_a_wanted_shape() -> None:
    """Straight under a force across its end: the natural curvature is minus the moment, F (1 - s) / B, and stable."""
    s = np.linspace(0.1, 1.0, 10)
    straight = np.column_stack([0 * s, s, 0 * s, 0 * s, s])
    found = rodfem.identify(arc().varying(F=0.8), {"shape": straight}, {"K": Field(5)})
    signed = np.array(list(found.values.values())) * np.sign(found.values["K_0"])
    assert signed == pytest.approx(0.8 * np.linspace(1.0, 0.0, 5), abs=1e-6)
    assert [point.index for point in found.points] == [0]


def test_from_critical_loads_and_what_is_not_determined() -> None:
    column = classics.column(
        "column", classics.SUPPORTS["clamped-free"], (0.0, 6.0), constants={"A": 1.0, "B": 1.5},
        energy=lambda v, k, c: bending_and_twist(k, (c.A, c.B, 1.0)),
    )  # fmt: skip
    found = rodfem.identify(column, {"critical loads": [0.3 * pi**2, 0.45 * pi**2]}, ("A", "B"))
    assert found.values == pytest.approx({"A": 1.2, "B": 1.8})
    with pytest.raises(ConvergenceError, match="do not determine B"):
        rodfem.identify(column, {"critical loads": [0.3 * pi**2]}, ("A", "B"))
    with pytest.raises(InputError, match="choose one of critical loads, ordinate, shape"):
        rodfem.identify(column, {"loads": [1.0]}, ("A",))
    with pytest.raises(InputError, match="give rows of 2 finite numbers"):
        rodfem.identify(column, {"ordinate": [1.0, 2.0, 3.0]}, ("A",))
    with pytest.raises(InputError, match="give a positive one for each kind"):
        rodfem.identify(column, {"critical loads": [1.0]}, ("A",), {"shape": 0.1})
    with pytest.raises(InputError, match="no constant of the scene"):
        rodfem.identify(column, {"critical loads": [1.0]}, ("P",))
    with pytest.raises(InputError, match="follower force on the right end has none"):  # it flutters at 20.05
        rodfem.identify(classics.partly_following(1.0, (0.0, 25.0)), {"critical loads": [20.0]}, ("B2",))
