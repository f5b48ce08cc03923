"""Numbers, special points and rows in words: for the terminal, the page, notebooks and commands.

Special points and rows are those of the contents of ``diagram.json``; a run that is not saved yet has the same from
:mod:`rodfem.output.table`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, floor, inf, isfinite, log10, nan
from typing import Any

from rodfem.continuation.branch import ORDINATE, PITCHFORK, VERTICAL_BRANCH
from rodfem.continuation.kinds import END, FLUTTER, KINDS
from rodfem.errors import many
from rodfem.output.pieces import COMPLETE, is_solved
from rodfem.output.table import reactions_by_name, soft_modes
from rodfem.stability import soft_mode
from rodfem.stability.soft_mode import ONE_SIDE, index_range, on_kink, stability
from rodfem.tolerances import NEGLIGIBLE, unit

Data = Mapping[str, Any]
STABLE, PLANAR, UNSTABLE, CRITICAL, UNDECIDED = "stable", "planar", "unstable", "critical", "undecided"
VERDICTS = {soft_mode.STABLE: STABLE, soft_mode.PLANAR: PLANAR, soft_mode.UNDECIDED: UNDECIDED}
INDEX, COUNT = "index", "unstable"
"""Headings of the number of negative eigenvalues; without a potential, of that of eigenvalues negative or complex."""
READ = {"load": "error_estimate", "ordinate": "ordinate_error_estimate"}
"""Numbers of a row whose errors files have, and where special points have them."""
FINEST, LARGEST = 9e-15, 1e12  # least error, and greatest number, that are written without an exponent
NO_ESTIMATE, GIVEN = " (no estimate)", " (given)"
"""Behind a number without an error bar, and behind a load that was asked for."""


# --- numbers


def rounded_up(error: float) -> float:
    """An error with one digit, never smaller than it is (but for round-off)."""
    if not (isfinite(error) and error > 0):
        return error
    power = floor(log10(error))
    return float(f"{ceil(error / 10.0**power * (1 - NEGLIGIBLE))}e{power}")


def greatest_error(what: str, special: Sequence[Data]) -> str:
    """Greatest error of the loads of ``special`` points, ``what`` they are, and how many are known; or empty."""
    bars = [point.get("error_estimate") for point in special if point.get("resolved") is not False]
    known = [abs(bar) for bar in bars if bar is not None and isfinite(bar)]
    share = f" (of {len(known)} out of {len(special)})" if len(known) < len(special) else ""
    return f"error of {what} at most {rounded_up(max(known)):.0e}{share}" if known else ""


def number(value: float, error: float, resolved: bool | None = True, scale: float = 0.0) -> str:
    """A ``value`` with the digits that its error supports, and its bar: ``0.3216501 (3e-07)``.

    The bar is rounded up; to the error it adds what the digits left out amount to.  It is ``at least`` that where the
    mesh has not ``resolved`` the state.  Without an ``error`` what is round-off of numbers of the ``scale`` is zero.
    """
    if not isfinite(error):
        return f"{0.0 if abs(value) <= NEGLIGIBLE * scale else value:.8g}{NO_ESTIMATE}"
    digits = min(max(-floor(log10(rounded_up(error)) + NEGLIGIBLE), 0), 13) if error > 0 else 13
    least = "at least " if resolved is False else ""
    if (error > 0 and error < FINEST) or abs(value) >= LARGEST:  # of a rod whose units are far from its own size
        significant = floor(log10(abs(value))) - floor(log10(error)) if abs(value) > error > 0 else 0
        text = f"{value:.{min(max(significant, 0), 13)}e}" if abs(value) > error else "0"
    else:
        text = f"{round(value, digits) + 0.0:.{digits}f}"
    return f"{text} ({least}{rounded_up(error + abs(value - float(text))):.0e})"


def in_decimals(value: float, decimals: int, one: float) -> str:
    """A number with some decimals, or, where its natural size ``one`` is far from one, as many digits."""
    if one == 1.0:
        return f"{round(value, decimals) + 0.0:.{decimals}f}"
    return "0" if abs(value) < 10.0**-decimals * one else f"{value:.{max(decimals - 4, 3)}e}"


def with_unit(text: str, unit: str) -> str:
    """A number in words, with the name of its unit if it has one."""
    return f"{text} [{unit.replace('$', '')}]" if unit else text


def mesh_in_words(d: Data) -> str:
    """Discretisation, as files record it, in words."""
    return f"{d['formulation']} formulation, {d['elements']} elements of degree {d['degree']}, {d['unknowns']} unknowns"


def eigenvalue_in_words(mu: complex, error: float) -> str:
    """An eigenvalue with the bound of its error, once; with ten digits where that is not known."""
    if not isfinite(error):
        return f"{mu.real:.10g}" + (f" {'+' if mu.imag > 0 else '-'} {abs(mu.imag):.10g} i" if mu.imag else "")
    (real, bar), (imaginary, other) = (number(x, error).split(" ", 1) for x in (mu.real, abs(mu.imag)))
    if not mu.imag:
        return f"{real} {bar}"
    return f"{real} {'+' if mu.imag > 0 else '-'} {imaginary} i {max(bar, other, key=lambda x: float(x.strip('()')))}"


# --- special points


def is_sweep(data: Data) -> bool:
    """Whether stability is that of frequencies, under loads without a potential."""
    return any("omega2" in branch["columns"] for branch in data["branches"])


def row_of(branch: Data, row: int) -> dict[str, Any]:
    """Columns of one row, and whether its eigenvalues are ``rates`` of decay."""
    kind = {"rates": True} if branch.get("rates") else {}
    return {name: column[row] for name, column in branch["columns"].items()} | kind


def index_in_words(special: Data, row: Data) -> str:
    """Index at a special point, whose columns are ``row``: before and after if it changes."""
    before, after = special["negative_before"], special["negative_after"]
    index = f"{before}->{after}" if before != after else index_range(row["negative"], row.get("undecided") or 0)
    index += f" {ONE_SIDE}" if row.get("kink") else ""
    space = row.get("negative_in_space")
    return index if space is None else f"{index} (in space {space})"


def special_lines(data: Data) -> Iterator[str]:
    """Table of all special points, with what else there is to say of each."""
    load, ordinate = (with_unit(data[x], data.get(f"{x}_unit") or "") for x in ("parameter", "ordinate"))
    rows = list(table_of(data))
    bars = "in parentheses a bound of the error" if _is_estimated(data) else "no estimate of the errors"
    yield f"Special points ({bars}; ordinate: {ordinate})"
    wide = max([len("branch point"), *(len(row[1]) for row in rows)])
    yield f"  {'branch':<12} {'kind':<{wide}} {load:<24} {'ordinate':<24} {COUNT if is_sweep(data) else INDEX}"
    for name, kind, *numbers, index, remarks in rows:
        yield f"  {name:<12} {kind:<{wide}} {numbers[0]:<24} {numbers[1]:<24} {index}"
        yield from (f"    {remark}" for remark in remarks)


def _is_estimated(data: Data) -> bool:
    """Whether the error of the load of any special point is estimated."""
    return any(x.get("error_estimate") is not None for branch in data["branches"] for x in branch["special"])


def table_of(data: Data) -> Iterator[tuple[str, str, str, str, str, list[str]]]:
    """Branch, kind, load, ordinate and index of each special point, and remarks; without bars where none is known."""
    scale, known = _scale(data), _is_estimated(data)
    for branch, special in ((b, special) for b in data["branches"] for special in b["special"]):
        row = row_of(branch, special["row"])
        found = {x: _read(special, x, inf, scale * (x == "ordinate")) for x in READ} | _request(branch, special)
        load, ordinate = (x if known else x.removesuffix(NO_ESTIMATE) for x in found.values())
        index = index_in_words(special, row) + (f", {special['zero']} zero" if special["zero"] else "")
        reason = [branch["ended"]] * (special["kind"] == END and special["row"] > 0 and branch["ended"] not in COMPLETE)
        yield branch["name"], KINDS[special["kind"]].words, load, ordinate, index, reason + _remarks(special, row)


def _scale(data: Data) -> float:
    """Size of the ordinates of a diagram."""
    values = [abs(x) for branch in data["branches"] for x in branch["columns"]["ordinate"] if x is not None]
    return max([*values, (data.get("natural") or {}).get("ordinate", 0.0)])


def _read(special: Data, name: str, unknown: float | None, scale: float = 0.0) -> str:
    """Load or ordinate of a special point with its bar; ``unknown`` stands for one that it has not."""
    found = special.get(READ[name])
    bar = unknown if found is None else found
    return "" if bar is None else number(special[name], bar, special.get("resolved"), scale)


def _request(branch: Data, special: Data) -> dict[str, str]:
    """Load of a special point by its name where it is given, and exact."""
    given = KINDS[special["kind"]].request and not is_solved(branch, special)
    return {"load": f"{special['load']:.10g}"} if given else {}


def _remarks(special: Data, row: Data) -> list[str]:
    """What else there is to say of a special point, whose columns are ``row``."""
    remarks = [str(mode) for mode in soft_modes(row)]
    if special["kind"] == FLUTTER and special.get("omega2") is not None:
        omega2, bar = special["omega2"], special.get("omega2_error_estimate")
        bar = inf if bar is None else bar
        oscillates = f"frequency {number(omega2**0.5, bar / (2 * omega2**0.5))}" if row.get("rates") else ""
        remarks.append(oscillates or f"double eigenvalue omega^2 = {number(omega2, bar)}")
    remarks += [law_in_words(special)] if special.get("law") else []
    return remarks + ([special["note"]] if special.get("note") else [])


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
    """Load and ordinate of each row of a branch, those with an estimate, as ``0.3216501 (3e-07)``."""
    rows = len(branch["columns"]["load"])
    found = [_reading(row_of(branch, row), natural) for row in range(rows)]
    for special in branch["special"]:
        here = {name: text for name in READ if (text := _read(special, name, None))}
        given = {name: text + GIVEN for name, text in _request(branch, special).items()}
        found[special["row"]] = _derived(special, branch) | here | given
    return found


def _derived(special: Data, branch: Data) -> dict[str, str]:
    """Energies and reactions of a special point with their bars."""
    row, bars = row_of(branch, special["row"]), special.get("errors") or {}
    pairs: dict[str, Any] = {name: (row.get(name), bars.get(name)) for name in ("energy", "potential", "conjugate")}
    known, errors = (reactions_by_name(x.get("reactions") or ()) for x in (row, bars))
    pairs |= {name: (known.get(name), bar) for name, bar in errors.items()}
    return {n: number(x, bar, special.get("resolved")) for n, (x, bar) in pairs.items() if None not in (x, bar)}


def _reading(row: Data, natural: Mapping[str, float]) -> dict[str, str]:
    """Numbers of a row by name, with bounds of their relative error."""
    if (error := row.get("estimate")) is None:
        return {}
    values = {name: row[name] for name in READ if row[name] is not None}
    return {name: number(x, error * unit(x, one=natural[name])) for name, x in values.items()}


# --- rows


@dataclass(frozen=True)
class Words:
    """``verdict`` is one of the five above; ``index`` short, as ``0`` or ``0→1``; ``sentence`` says both in full."""

    verdict: str
    index: str
    sentence: str


def words_of(branch: Data, *, planar: bool = False, leaves: str = "") -> list[Words]:
    """Stability of each row of a branch of ``diagram.json``, with what is uncertain of it."""
    specials, doubtful, out = defaultdict(list), _doubts(branch), list[Words]()
    for special in branch["special"]:
        specials[special["row"]].append(special)
    for place in range(len(branch["columns"]["load"])):
        row = row_of(branch, place)
        plain = _at_special(row, specials[place]) or _stability(row)
        if place == 0 and leaves:
            plain = Words(CRITICAL, plain.index, f"Branch point, where it leaves {leaves}; index {plain.index}.")
        sentence = plain.sentence
        if planar and plain.verdict == STABLE and row.get("negative_in_space") is None:
            sentence = sentence.replace("Stable", "Stable in its plane (not examined in space)", 1)
        doubts = [f"Warning: {words}." for words in doubtful[place]]
        out.append(Words(plain.verdict, plain.index, " ".join([sentence, *doubts])))
    return out


def _doubts(branch: Data) -> dict[int, list[str]]:
    out = defaultdict(list)
    for change in branch.get("unexplained") or ():
        for row in (change["row"], change["row"] + 1):
            out[row].append("the index changes next to this row without a special point")
    if branch.get("singular_start"):
        out[0].append("the first state is singular, and not located")
    for special in branch["special"]:
        if special.get("resolved") is False:
            out[special["row"]].append("the mesh does not resolve this state")
    return out


def _at_special(row: Data, specials: Sequence[Data]) -> Words | None:
    """Words of a row with a special point at which something happens; None without one."""
    kinds = [(KINDS[special["kind"]], special) for special in specials]
    special = next((x for kind, x in kinds if not kind.request and kind.test != "number"), None)
    if special is None or special["negative_before"] is None:
        return None
    before, after = special["negative_before"], special["negative_after"]
    change = (f"{before}→{after}" if before != after else str(before)) + (f" {ONE_SIDE}" if row.get("kink") else "")
    what = f": {many(special['multiplicity'], 'eigenvalue')} at zero" if special.get("multiplicity") else ""
    return Words(CRITICAL, change, f"{special['kind'].capitalize()}{what}; index {change} along the branch.")


def _stability(row: Data) -> Words:
    negative, undecided, space = row["negative"], row.get("undecided") or 0, row.get("negative_in_space")
    if row.get("kink"):
        side = f"{many(negative, 'negative eigenvalue')} on one side" + (f", and {_open(undecided)}" * bool(undecided))
        sentence = f"Stability undecided: {on_kink(row['kink'])}; {side}."
        return Words(UNDECIDED, index_range(negative, undecided, row["kink"]), sentence)
    if "omega2" in row:
        return _of_frequencies(negative, row["omega2"], rates=bool(row.get("rates")))
    verdict = VERDICTS.get(stability(negative, undecided, in_space=space), UNSTABLE)
    index = index_range(negative, undecided) + ("" if space is None or undecided else f" ({space})")
    zero = row["zero"]
    neutral = f" {many(zero, 'eigenvalue')} {'is' if zero == 1 else 'are'} zero." if zero else ""
    return Words(verdict, index, f"{_verdict(negative, undecided, space)}.{neutral}")


def _verdict(negative: int, undecided: int, space: int | None) -> str:
    """Stability in words, by numbers of eigenvalues: negative ones, undecided ones, and negative ones in space."""
    if undecided:
        begin = f"Unstable: {many(negative, 'negative eigenvalue')}, and" if negative else "Stability undecided:"
        return f"{begin} {_open(undecided)}"
    if negative:
        return f"Unstable: {many(negative, 'negative eigenvalue')}"
    if space:
        return f"Stable in the plane, unstable in space: {many(space, 'negative eigenvalue')} there"
    return "Stable: no negative eigenvalue of the second variation"


def _open(undecided: int) -> str:
    return f"{many(undecided, 'eigenvalue')} whose sign is not known on this mesh"


def _of_frequencies(negative: int, values: Sequence[Sequence[float]], *, rates: bool) -> Words:
    """Words for a state by its squared frequencies, or ``rates`` of decay, those found."""
    found = f"of the {len(values)} {'rates of decay' if rates else 'values ω²'} found"
    if not negative:
        return Words(STABLE, "0", f"Stable: none {found} is negative{'' if rates else ' or complex'}.")
    growing = sum(1 for real, imaginary in values if imaginary and (real < 0.0 or not rates))
    kinds = [f"{growing} complex (flutter)"] if growing else []
    kinds += [f"{negative - growing} negative (divergence)"] if negative > growing else []
    return Words(UNSTABLE, str(negative), f"Unstable: {found}, {' and '.join(kinds)}.")
