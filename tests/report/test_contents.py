"""What a report says and shows, against closed forms: labels, words, writhe, shapes, placed bodies, packed arrays."""

import base64
import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rodfem.modes.modes import RIGID
from rodfem.output.plot_frequencies import curves
from rodfem.output.table import plain
from rodfem.output.words import readings_of, words_of
from rodfem.report.branches import _spectrum, _without_noise, html_of, packed, plain_of, script_json
from rodfem.report.rods import shapes_of
from rodfem.writhe import writhe


def special(row: int, kind: str = "branch point", before: int = 0, after: int = 1, **more: Any) -> dict[str, Any]:
    known = {"kind": kind, "row": row, "load": float(row), "negative_before": before, "negative_after": after}
    return known | {"multiplicity": 1, "resolved": True, "error_estimate": 1e-6} | more


def branch(negative: list[int], *specials: dict[str, Any], **columns: Any) -> dict[str, Any]:
    given = {"load": [float(i) for i in range(len(negative))], "negative": negative, "zero": [0] * len(negative)}
    return {"name": "first", "columns": given | columns, "special": list(specials), "parent": None}


@pytest.mark.parametrize(
    ("label", "always", "html"),
    [
        (r"\lambda", True, "λ"),
        ("t_0", True, "t<sub>0</sub>"),
        (r"twist $\int k_3\,ds/2\pi$", False, "twist ∫k<sub>3</sub> ds/2π"),
        (r"$\frac{a}{b}^{2}$", False, "a/b<sup>2</sup>"),
        ("a_b", False, "a_b"),
        (r"\Omega_{max}", True, "Ω<sub>max</sub>"),
        ("<img src=x onerror=alert(1)>", False, "&lt;img src=x onerror=alert(1)&gt;"),
        ("$</script><b>_3$", False, "&lt;/script&gt;&lt;b&gt;<sub>3</sub>"),
    ],
)
def test_labels(label: str, always: bool, html: str) -> None:
    assert html_of(label, always) == html
    assert "<sub>" not in plain_of(label, always)


def test_words_of_a_branch() -> None:
    words = words_of(branch([0, 0, 1, 2], special(1), zero=[0, 1, 0, 0]))
    assert [w.verdict for w in words] == ["stable", "critical", "unstable", "unstable"]
    assert [w.index for w in words] == ["0", "0→1", "1", "2"]
    assert "1 eigenvalue at zero" in words[1].sentence and words[3].sentence == "Unstable: 2 negative eigenvalues."


def test_a_branch_begins_at_a_branch_point() -> None:
    """Where it leaves another one no state is called stable or unstable."""
    first, *others = words_of(branch([0, 0]), leaves="straight")
    assert (first.verdict, first.index) == ("critical", "0") and "leaves straight" in first.sentence
    assert [w.verdict for w in others] == ["stable"]


def test_words_of_frequencies() -> None:
    omega2 = [[[1.0, 0.0], [4.0, 0.0]], [[2.0, 1.0], [2.0, -1.0]], [[-1.0, 0.0], [2.0, 0.0]]]
    words = words_of(branch([0, 2, 1], omega2=omega2))
    assert "none" in words[0].sentence and "2 complex (flutter)" in words[1].sentence
    assert "1 negative (divergence)" in words[2].sentence and "flutter" not in words[2].sentence
    planar = words_of(branch([0, 2, 1], omega2=omega2), planar=True)
    assert (
        planar[0].sentence.startswith("Stable in its plane (not examined in space): none") and planar[1:] == words[1:]
    )


def test_eigenvalues_that_vanish_are_zero() -> None:
    """As many as the count of the row has, whatever the sign of their round-off; others keep theirs."""
    spectrum = [[-2e-13, 3e-14, 4.0], [-2e-13, 3e-14, 4.0], [1e-3, 2.0, 4.0]]
    found = _spectrum(branch([0, 0, 0], spectrum=spectrum, zero=[0, 1, 1]))
    assert found == [spectrum[0], [-2e-13, 0.0, 4.0], spectrum[2]]
    assert _spectrum(branch([0])) is None


def test_rigid_motions_have_no_frequency() -> None:
    """Round-off of either sign is neither a frequency nor a growth rate, nor a negative eigenvalue in the chart."""
    omega2 = [[[-4e-11, 0.0], [25.0, 0.0]], [[3e-11, 0.0], [36.0, 0.0]]]
    columns = {"load": [0.0, 1.0], "omega2": omega2, "motion": [[RIGID, "bending"]] * 2, "curve": [[0, 1]] * 2}
    assert _without_noise(columns) == [[[0.0, 0.0], [25.0, 0.0]], [[0.0, 0.0], [36.0, 0.0]]]
    bending, rigid = curves({"columns": columns})
    assert rigid.motion == RIGID and rigid.real.tolist() == [0.0, 0.0] and bending.real.tolist() == [5.0, 6.0]
    assert all(np.isnan(part).all() for curve in (bending, rigid) for part in curve.parts.values())


def gauss_integral(curve: np.ndarray, tangent: np.ndarray) -> float:
    """Writhe of a closed curve given at equal parameters, by the rectangle rule; the diagonal's integrand vanishes."""
    d = curve[:, None] - curve[None]
    distance = np.linalg.norm(d, axis=2) + np.eye(len(curve))
    density = np.einsum("ijk,ijk->ij", d, np.cross(tangent[:, None], tangent[None])) / distance**3
    return float(density.sum() * (2 * np.pi / len(curve)) ** 2 / (4 * np.pi))


def trefoil(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    curve = [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)]
    tangent = [np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t), -3 * np.cos(3 * t)]
    return np.array(curve).T, np.array(tangent).T


def test_writhe_of_a_knot() -> None:
    exact = gauss_integral(*trefoil(np.linspace(0, 2 * np.pi, 1200, endpoint=False)))
    round_ = (0.0, 2 * np.pi)

    def mirrored(t: np.ndarray) -> np.ndarray:
        return trefoil(t)[0] * (1, 1, -1)

    assert abs(exact) > 3 and writhe(lambda t: trefoil(t)[0], round_) == pytest.approx(exact, abs=1e-4)
    assert writhe(mirrored, round_) == pytest.approx(-exact, abs=1e-4)
    assert writhe(lambda t: trefoil(-t)[0], round_) == pytest.approx(exact, abs=1e-4)
    assert writhe(lambda t: trefoil(t)[0] * (1, 1, 0), round_) == pytest.approx(0.0, abs=1e-9)


def group_of(**arrays: np.ndarray) -> Any:
    class Group(dict[str, Any]):
        file, name = SimpleNamespace(filename="states.h5"), "/branches/b"

    return Group({name: np.asarray(value)[None] for name, value in arrays.items()})


def helix(s: np.ndarray, radius: float, rise: float) -> tuple[np.ndarray, np.ndarray]:
    """Helix with arclength: rotations about e3 of a frame with d3 along its tangent; constant curvature and torsion."""
    size = np.hypot(radius, rise)
    t = s / size
    r = np.array([radius * np.cos(t), radius * np.sin(t), rise * t]).T
    tilt = np.arctan2(radius, rise)  # first about e1, such that e3 goes to the tangent at s = 0
    q0 = np.array([np.cos(-tilt / 2), np.sin(-tilt / 2), 0, 0])
    about = np.array([np.cos(t / 2), 0 * t, 0 * t, np.sin(t / 2)]).T
    a, d = about[:, 0], about[:, 3]
    q = np.array([a * q0[0], a * q0[1], d * q0[1], d * q0[0]]).T
    return r, q


def test_shapes_of_a_helix() -> None:
    s, radius, rise = np.linspace(0, 7, 80), 0.7, 0.4
    r, q = helix(s, radius, rise)
    signs = np.where(np.arange(80) % 3, 1.0, -1.0)[:, None]  # q and -q are the same rotation
    shapes = shapes_of(group_of(s=s, r=r, q=3.0 * signs * q), 49)
    exact, _ = helix(shapes.s, radius, rise)
    d3 = np.array([shapes[0][1][i, :, 2] for i in range(len(shapes.s))])
    tangent = np.gradient(exact, shapes.s, axis=0, edge_order=2)
    assert np.allclose(shapes.r[0], exact, atol=1e-5)
    assert np.allclose(d3, tangent / np.linalg.norm(tangent, axis=1)[:, None], atol=2e-2)
    assert (
        np.allclose(np.linalg.norm(shapes.q, axis=2), 1.0) and (np.sum(shapes.q[0, 1:] * shapes.q[0, :-1], 1) > 0).all()
    )


def test_packed_arrays_and_texts() -> None:
    array = np.array([[1.5, np.nan], [-2.0, 3e-8]])
    data = packed(array)
    back = np.frombuffer(base64.b64decode(data["f32"]), "<f4").reshape(data["shape"])
    assert np.array_equal(back, array.astype("f4"), equal_nan=True) and plain(array[0]) == [1.5, None]
    hostile = {"a": "</script><!-- <img src=x onerror=alert(1)> & \u2028"}
    text = script_json(hostile)
    assert json.loads(text) == hostile and not set(text) & set("<>&\u2028")


def test_words_warn() -> None:
    doubtful = branch([0, 1, 1], special(2, "fold", 1, 0, resolved=False)) | {"unexplained": [{"row": 0}]}
    words = words_of(doubtful | {"singular_start": 1})
    assert words[0].sentence.count("Warning") == 2 and "without a special point" in words[1].sentence
    assert "does not resolve" in words[2].sentence
    given = words_of(branch([0, 0], special(1, "user", 0, 0, multiplicity=0)))
    assert given[1].verdict == "stable"


def test_readings_are_those_of_the_file() -> None:
    """Bounds of special points are absolute, those of other rows relative, in parts of the natural size at least."""
    known = [special(1, ordinate=0.25, ordinate_error_estimate=None), special(3, "user", ordinate=2.0)]
    one = branch([0, 0, 1, 1], *known, ordinate=[0.5, 0.25, 0.125, 2.0], estimate=[1e-3, 1e-3, None, 1e-3])
    first, second, third, fourth = readings_of(one | {"ended": ""}, {"load": 10.0, "ordinate": 1.0})
    assert first == {"load": "0.00 (1e-02)", "ordinate": "0.500 (1e-03)"}
    assert second == {"load": "1.000000 (1e-06)"} and third == {} and fourth == {"load": "3 (given)"}


def test_undecided_stability_is_not_called_stable() -> None:
    words = words_of(branch([0, 0, 1], undecided=[0, 1, 1]))
    assert [w.verdict for w in words] == ["stable", "undecided", "unstable"]
    assert [w.index for w in words] == ["0", "0 or 1", "1 or 2"]
    assert all("eigenvalue whose sign is not known on this mesh" in w.sentence for w in words[1:])
    kink = branch([0, 1], undecided=[0, 1])
    kink["columns"]["kink"] = ["", "spring"]
    assert "1 negative eigenvalue on one side, and 1 eigenvalue whose sign" in words_of(kink)[1].sentence
