"""Special points and rows of a diagram in words: each is made here, for the terminal, the page, notebooks and commands.

They are those of the contents of ``diagram.json``; a run that is not saved yet has the same from
:mod:`rodfem.output.table`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import Any

from rodfem.continuation.branch import ORDINATE, PITCHFORK, VERTICAL_BRANCH
from rodfem.continuation.kinds import FLUTTER, KINDS
from rodfem.errors import many
from rodfem.output.digits import NO_ESTIMATE, number
from rodfem.output.pieces import is_solved
from rodfem.output.table import soft_modes
from rodfem.stability import soft_mode
from rodfem.stability.soft_mode import ONE_SIDE, index_range, on_kink, stability
from rodfem.tolerances import unit

Data = Mapping[str, Any]
STABLE, PLANAR, UNSTABLE, CRITICAL, UNDECIDED = "stable", "planar", "unstable", "critical", "undecided"
VERDICTS = {soft_mode.STABLE: STABLE, soft_mode.PLANAR: PLANAR, soft_mode.UNDECIDED: UNDECIDED}
INDEX, COUNT = "index", "unstable"
"""Headings of the number of negative eigenvalues; without a potential, of that of eigenvalues negative or complex."""
READ = ("load", "ordinate")
"""Numbers of a row whose errors files have; those of energies and of left-most eigenvalues are not estimated."""
GIVEN = "(given)"
"""What stands in place of a bound at a load that was asked for."""


@dataclass(frozen=True)
class Words:
    """``verdict`` is one of the five above; ``index`` short, as ``0`` or ``0→1``; ``sentence`` says both in full."""

    verdict: str
    index: str
    sentence: str


def is_sweep(data: Data) -> bool:
    """Whether stability is that of frequencies, under loads without a potential."""
    return any("omega2" in branch["columns"] for branch in data["branches"])


def row_of(branch: Data, row: int) -> dict[str, Any]:
    """Columns of one row."""
    return {name: column[row] for name, column in branch["columns"].items()}


# --- special points ---------------------------------------------------------------------------------------------------


def index_in_words(special: Data, row: Data) -> str:
    """Index at a special point, whose columns are ``row``: before and after if it changes."""
    before, after = special["negative_before"], special["negative_after"]
    index = f"{before}->{after}" if before != after else index_range(row["negative"], row.get("undecided") or 0)
    index += f" {ONE_SIDE}" if row.get("kink") else ""
    space = row.get("negative_in_space")
    return index if space is None else f"{index} (in space {space})"


def scale_of(data: Data) -> float:
    """Size of the ordinates of a diagram."""
    values = [abs(x) for branch in data["branches"] for x in branch["columns"]["ordinate"] if x is not None]
    return max([*values, (data.get("natural") or {}).get("ordinate", 0.0)])


def special_in_words(branch: Data, special: Data, scale: float = 0.0) -> tuple[str, str, str]:
    """Load, ordinate and index of a special point; a load that is given is exact.  ``scale`` is that of ordinates."""
    resolved = special.get("resolved")
    load = number(special["load"], _bar(special, "error_estimate"), resolved)
    ordinate = number(special["ordinate"], _bar(special, "ordinate_error_estimate"), resolved, scale)
    if KINDS[special["kind"]].given and not is_solved(branch, special):
        load = f"{special['load']:.10g}"
    return load, ordinate, index_in_words(special, row_of(branch, special["row"]))


def is_estimated(data: Data) -> bool:
    """Whether the error of the load of any special point is estimated."""
    return any(
        special.get("error_estimate") is not None for branch in data["branches"] for special in branch["special"]
    )


def table_of(data: Data) -> Iterator[tuple[str, str, str, str, str, list[str]]]:
    """Branch, kind, load, ordinate and index of each special point, and remarks; without bars where none is known."""
    scale, every = scale_of(data), [(branch, special) for branch in data["branches"] for special in branch["special"]]
    known = is_estimated(data)
    for branch, special in every:
        load, ordinate, index = special_in_words(branch, special, scale)
        load, ordinate = (x if known else x.removesuffix(NO_ESTIMATE) for x in (load, ordinate))
        index += f", {special['zero']} zero" if special["zero"] else ""
        remarks = _remarks(special, row_of(branch, special["row"]))
        yield branch["name"], KINDS[special["kind"]].words, load, ordinate, index, remarks


def _remarks(special: Data, row: Data) -> list[str]:
    """What else there is to say of a special point, whose columns are ``row``."""
    remarks = [str(mode) for mode in soft_modes(row)]
    if special["kind"] == FLUTTER and special.get("omega2") is not None:
        remarks.append(
            f"double eigenvalue omega^2 = {number(special['omega2'], _bar(special, 'omega2_error_estimate'))}"
        )
    remarks += [law_in_words(special)] if special.get("law") else []
    return remarks + ([special["note"]] if special.get("note") else [])


def _bar(special: Data, name: str) -> float:
    """A bound of an error; not finite where there is none."""
    found = special.get(name)
    return inf if found is None else found


def law_in_words(special: Data) -> str:
    """Local law of a branch point; its coefficient has the digits of its bound if the mesh resolves the state."""
    law = special["law"]
    kind, c, bar = law["kind"], law["coefficient"], nan if law["uncertainty"] is None else law["uncertainty"]
    if kind == VERTICAL_BRANCH:
        return f"{kind}: a family of equilibria at one and the same load"
    even = law["power"] == 1 and PITCHFORK in kind
    x, what = "x", "x the change of the ordinate" + ", of second order in the amplitude" * even
    if law["of"] != ORDINATE:
        x, what = "a", "a the distance from there in the metric, as the ordinate does not change to leading order"
    x += f"^{law['power']}" if law["power"] > 1 else ""
    if isfinite(bar) and bar >= abs(c):
        return f"{kind}, load = load_b + c {x} + ..., where c is not distinguished from zero; {what}"
    size = number(abs(c), bar, special.get("resolved"))
    return f"{kind}, load = load_b {'-' if c < 0 else '+'} {size} {x} + ..., {what}"


def readings_of(branch: Data, natural: Mapping[str, float]) -> list[dict[str, str]]:
    """Load and ordinate of each row of a branch, those with an estimate, as ``0.3216501 (3e-07)``.

    Special points have bounds of their own.  Those of other rows are relative, to ``natural`` sizes by the name of the
    number.
    """
    columns = branch["columns"]
    relative = columns.get("estimate") or [None] * len(columns["load"])
    rows = ({name: columns[name][row] for name in READ} for row in range(len(relative)))
    found = [_reading(values, error, natural) for values, error in zip(rows, relative, strict=True)]
    for special in branch["special"]:
        bars = zip(READ, (special.get("error_estimate"), special.get("ordinate_error_estimate")), strict=True)
        here = {name: number(special[name], x, special.get("resolved")) for name, x in bars if x is not None}
        given = KINDS[special["kind"]].given and not is_solved(branch, special)
        found[special["row"]] = here | ({"load": f"{special['load']:.10g} {GIVEN}"} if given else {})
    return found


def _reading(values: Data, error: float | None, natural: Mapping[str, float]) -> dict[str, str]:
    """Numbers of a row by name, with bounds of a relative error."""
    known = {} if error is None else {name: value for name, value in values.items() if value is not None}
    return {name: number(x, error * unit(x, one=natural[name])) for name, x in known.items()}  # type: ignore[operator]


# --- rows -------------------------------------------------------------------------------------------------------------


def words_of(branch: Data, *, planar: bool = False) -> list[Words]:
    """Stability of each row of a branch of ``diagram.json``, with what is uncertain of it.

    Of a ``planar`` rod it is that in its plane, where nothing tells it in space.
    """
    specials: dict[int, list[Data]] = {}
    for special in branch["special"]:
        specials.setdefault(special["row"], []).append(special)
    doubts: dict[int, list[str]] = {}
    for place, sentence in _warnings(branch):
        doubts.setdefault(place, []).append(f"Warning: {sentence}.")
    out = []
    for place in range(len(branch["columns"]["load"])):
        row = row_of(branch, place)
        plain = _at_special(row, specials.get(place, [])) or _stability(row)
        sentence = plain.sentence
        if planar and plain.verdict == STABLE and row.get("negative_in_space") is None:
            sentence = sentence.replace("Stable", "Stable in its plane (not examined in space)", 1)
        out.append(Words(plain.verdict, plain.index, " ".join([sentence, *doubts.get(place, [])])))
    return out


def _at_special(row: Data, specials: Sequence[Data]) -> Words | None:
    """Words of a row with a special point at which something happens; None without one."""
    kinds = [(KINDS[special["kind"]], special) for special in specials]
    special = next((x for kind, x in kinds if not kind.given and kind.test != "number"), None)
    if special is None or special["negative_before"] is None:
        return None
    before, after = special["negative_before"], special["negative_after"]
    change = (f"{before}→{after}" if before != after else str(before)) + (f" {ONE_SIDE}" if row.get("kink") else "")
    what = f": {many(special['multiplicity'], 'eigenvalue')} at zero" if special.get("multiplicity") else ""
    return Words(CRITICAL, change, f"{special['kind'].capitalize()}{what}; index {change} along the branch.")


def _stability(row: Data) -> Words:
    negative, undecided, space = row["negative"], row.get("undecided") or 0, row.get("negative_in_space")
    if row.get("kink"):
        more = f", and {_too_near_zero(undecided)}" if undecided else ""
        side = f"{many(negative, 'negative eigenvalue')} on one side{more}"
        sentence = f"Stability undecided: {on_kink(row['kink'])}; {side}."
        return Words(UNDECIDED, index_range(negative, undecided, row["kink"]), sentence)
    if "omega2" in row:
        return _of_frequencies(negative, row["omega2"])
    verdict = VERDICTS.get(stability(negative, undecided, in_space=space), UNSTABLE)
    index = index_range(negative, undecided) + ("" if space is None or undecided else f" ({space})")
    return Words(verdict, index, f"{_verdict(negative, undecided, space)}.{_neutral(row['zero'])}")


def _verdict(negative: int, undecided: int, space: int | None) -> str:
    """Stability in words, by numbers of eigenvalues: negative ones, undecided ones, and negative ones in space."""
    if undecided:
        begin = f"Unstable: {many(negative, 'negative eigenvalue')}, and" if negative else "Stability undecided:"
        return f"{begin} {_too_near_zero(undecided)}"
    if negative:
        return f"Unstable: {many(negative, 'negative eigenvalue')}"
    if space:
        return f"Stable in the plane, unstable in space: {many(space, 'negative eigenvalue')} there"
    return "Stable: no negative eigenvalue of the second variation"


def _neutral(zero: int) -> str:
    return f" {many(zero, 'eigenvalue')} {'is' if zero == 1 else 'are'} zero." if zero else ""


def _too_near_zero(undecided: int) -> str:
    sign = "its" if undecided == 1 else "their"
    return f"{many(undecided, 'eigenvalue')} too near zero for {sign} sign to be known on this mesh"


def _of_frequencies(negative: int, omega2: Sequence[Sequence[float]]) -> Words:
    """Words for a state under loads without potential, by its squared frequencies, those found."""
    found = f"of the {len(omega2)} values ω² found"
    if not negative:
        return Words(STABLE, "0", f"Stable: none {found} is negative or complex.")
    growing = sum(1 for value in omega2 if value[1])
    kinds = [f"{growing} complex (flutter)"] if growing else []
    kinds += [f"{negative - growing} negative (divergence)"] if negative > growing else []
    return Words(UNSTABLE, str(negative), f"Unstable: {found}, {' and '.join(kinds)}.")


def _warnings(branch: Data) -> Iterator[tuple[int, str]]:
    for change in branch.get("unexplained") or ():
        for row in (change["row"], change["row"] + 1):
            yield row, "the index changes next to this row without a special point"
    if branch.get("singular_start"):
        yield 0, "the first state is singular, and not located"
    for special in branch["special"]:
        if special.get("resolved") is False:
            yield special["row"], "the mesh does not resolve this state"
