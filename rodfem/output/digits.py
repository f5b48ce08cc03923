"""Numbers in words: with the digits that their error supports, and its bar."""

from __future__ import annotations

from math import ceil, floor, isfinite, log10

from rodfem.tolerances import NEGLIGIBLE

FINEST, LARGEST = 9e-15, 1e12
"""Least error, and greatest number, that are written without an exponent."""
NO_ESTIMATE = " (no estimate)"
"""Behind a number without an error bar."""
WHOLE = 1e-9
"""Round-off of the logarithm of a power of ten."""


def rounded_up(error: float) -> float:
    """Return an error with one digit, never smaller than it is (but for round-off)."""
    if not (isfinite(error) and error > 0):
        return error
    power = floor(log10(error))
    return float(f"{ceil(error / 10.0**power * (1 - NEGLIGIBLE))}e{power}")


def number(value: float, error: float, resolved: bool | None = True, scale: float = 0.0) -> str:
    """Write a ``value`` with the digits that its error supports, and its bar: ``0.3216501 (3e-07)``.

    The bar is rounded up; to the error it adds what the digits left out amount to.  ``(at least 3e-02)`` where the mesh
    has not ``resolved`` what the number is of.  Without an ``error`` that is finite it says so, and is zero where it is
    round-off of numbers of the ``scale``.
    """
    if not isfinite(error):
        return f"{0.0 if abs(value) <= NEGLIGIBLE * scale else value:.8g}{NO_ESTIMATE}"
    digits = min(max(-floor(log10(rounded_up(error)) + WHOLE), 0), 13) if error > 0 else 13
    least = "at least " if resolved is False else ""
    if (error > 0 and error < FINEST) or abs(value) >= LARGEST:  # of a rod whose units are far from its own size
        significant = floor(log10(abs(value))) - floor(log10(error)) if abs(value) > error > 0 else 0
        text = f"{value:.{min(max(significant, 0), 13)}e}" if abs(value) > error else "0"
    else:
        text = f"{round(value, digits) + 0.0:.{digits}f}"
    return f"{text} ({least}{rounded_up(error + abs(value - float(text))):.0e})"


def in_decimals(value: float, decimals: int, one: float) -> str:
    """Write a number with some decimals, or, where its natural size ``one`` is far from one, as many digits."""
    if one == 1.0:
        return f"{round(value, decimals) + 0.0:.{decimals}f}"
    return "0" if abs(value) < 10.0**-decimals * one else f"{value:.{max(decimals - 4, 3)}e}"


def with_unit(text: str, unit: str) -> str:
    """A number in words, with the name of its unit if it has one."""
    return f"{text} [{unit.replace('$', '')}]" if unit else text


def eigenvalue_in_words(mu: complex, error: float) -> str:
    """An eigenvalue with the bound of its error, once; empty where that is not known."""
    if not isfinite(error):
        return ""
    (real, bar), (imaginary, other) = (number(x, error).split(" ", 1) for x in (mu.real, abs(mu.imag)))
    if not mu.imag:
        return f"{real} {bar}"
    return f"{real} {'+' if mu.imag > 0 else '-'} {imaginary} i {max(bar, other, key=lambda x: float(x.strip('()')))}"
