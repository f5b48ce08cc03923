"""Stability of a row of a diagram in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rodfem.continuation.kinds import KINDS
from rodfem.stability.soft_mode import ONE_SIDE, index_range, on_kink

STABLE, PLANAR, UNSTABLE, CRITICAL, UNDECIDED = "stable", "planar", "unstable", "critical", "undecided"


@dataclass(frozen=True)
class Words:
    """``verdict`` is one of the five above; ``index`` short, as ``0`` or ``0→1``; ``sentence`` says both in full."""

    verdict: str
    index: str
    sentence: str


def words_of(branch: Mapping[str, Any], *, planar: bool = False) -> list[Words]:
    """Stability of each row of a branch of ``diagram.json``, with what is uncertain of it.

    Of a ``planar`` rod it is that in its plane, where nothing tells it in space.
    """
    columns = branch["columns"]
    specials: dict[int, list[Mapping[str, Any]]] = {}
    for special in branch["special"]:
        specials.setdefault(special["row"], []).append(special)
    doubts = _doubts(branch)
    out = []
    for row in range(len(columns["load"])):
        plain = _verdict(columns, row, specials.get(row, []))
        if planar and plain.verdict == STABLE and (columns.get("negative_in_space") or {row: None})[row] is None:
            sentence = plain.sentence.replace("Stable", "Stable in its plane (not examined in space)", 1)
            plain = replace(plain, sentence=sentence)
        out.append(replace(plain, sentence=" ".join([plain.sentence, *doubts.get(row, [])])))
    return out


def _verdict(columns: Mapping[str, Sequence[Any]], row: int, specials: Sequence[Mapping[str, Any]]) -> Words:
    crossing = next((x for x in specials if not KINDS[x["kind"]].given and KINDS[x["kind"]].test != "number"), None)
    if crossing is not None and crossing["negative_before"] is not None:
        before, after = crossing["negative_before"], crossing["negative_after"]
        change = f"{before}→{after}" if before != after else str(before)
        number = _many(crossing.get("multiplicity") or 0, "eigenvalue")
        what = f": {number} at zero" if crossing.get("multiplicity") else ""
        change += f" {ONE_SIDE}" if columns.get("kink", {row: ""})[row] else ""
        return Words(CRITICAL, change, f"{crossing['kind'].capitalize()}{what}; index {change} along the branch.")
    if kink := (columns.get("kink") or {row: ""})[row]:
        return _on_kink(columns, row, kink)
    if "omega2" in columns:
        return _of_frequencies(columns["negative"][row], columns["omega2"][row])
    negative, space = columns["negative"][row], (columns.get("negative_in_space") or {row: None})[row]
    zero = columns["zero"][row]
    neutral = f" {_many(zero, 'eigenvalue')} {'is' if zero == 1 else 'are'} zero." if zero else ""
    if undecided := (columns.get("undecided") or {row: 0})[row]:
        verdict = f"Unstable: {_many(negative, 'negative eigenvalue')}, and" if negative else "Stability undecided:"
        sentence = f"{verdict} {_too_near_zero(undecided)}.{neutral}"
        return Words(UNSTABLE if negative else UNDECIDED, index_range(negative, undecided), sentence)
    if negative:
        return Words(UNSTABLE, _pair(negative, space), f"Unstable: {_many(negative, 'negative eigenvalue')}.{neutral}")
    if space:
        sentence = f"Stable in the plane, unstable in space: {_many(space, 'negative eigenvalue')} there.{neutral}"
        return Words(PLANAR, _pair(0, space), sentence)
    return Words(STABLE, _pair(0, space), f"Stable: no negative eigenvalue of the second variation.{neutral}")


def _on_kink(columns: Mapping[str, Sequence[Any]], row: int, kink: str) -> Words:
    """Words for a state on a ``kink`` of the functions of that name."""
    negative, undecided = columns["negative"][row], (columns.get("undecided") or {row: 0})[row]
    sentence = f"Stability undecided: {on_kink(kink)}; {_many(negative, 'negative eigenvalue')} on one side"
    more = f", and {_too_near_zero(undecided)}" if undecided else ""
    return Words(UNDECIDED, index_range(negative, undecided, kink), f"{sentence}{more}.")


def _too_near_zero(undecided: int) -> str:
    sign = "its" if undecided == 1 else "their"
    return f"{_many(undecided, 'eigenvalue')} too near zero for {sign} sign to be known on this mesh"


def _pair(negative: int, space: int | None) -> str:
    """Index, and that in space in parentheses where it is known."""
    return str(negative) if space is None else f"{negative} ({space})"


def _of_frequencies(negative: int, omega2: Sequence[Sequence[float]]) -> Words:
    """Words for a state under loads without potential, by its squared frequencies, those found."""
    found = f"of the {len(omega2)} values ω² found"
    if not negative:
        return Words(STABLE, "0", f"Stable: none {found} is negative or complex.")
    growing = sum(1 for value in omega2 if value[1])
    kinds = [f"{growing} complex (flutter)"] if growing else []
    kinds += [f"{negative - growing} negative (divergence)"] if negative > growing else []
    return Words(UNSTABLE, str(negative), f"Unstable: {found}, {' and '.join(kinds)}.")


def _doubts(branch: Mapping[str, Any]) -> dict[int, list[str]]:
    """Warnings by the rows that they are about."""
    out: dict[int, list[str]] = {}
    for row, sentence in _warnings(branch):
        out.setdefault(row, []).append(sentence)
    return out


def _warnings(branch: Mapping[str, Any]) -> Iterator[tuple[int, str]]:
    for change in branch.get("unexplained") or ():
        for row in (change["row"], change["row"] + 1):
            yield row, "Warning: the index changes beside this row without a special point."
    if branch.get("singular_start"):
        yield 0, "Warning: the first state is singular, and not located."
    for special in branch["special"]:
        if special.get("resolved") is False:
            yield special["row"], "Warning: the mesh does not resolve this state."


def _many(count: int, noun: str) -> str:
    return f"{count} {noun}" + "s" * (count != 1)
