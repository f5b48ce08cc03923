#!/usr/bin/env python3
"""Builds the image of the Dockerfile, runs demos/cord.py in it, and compares its numbers with the recorded ones.

    tools/image.py [--engine podman] [--tag rodfem] [--no-build] [-- OPTIONS OF docker build]

The recorded numbers are those of tests/golden/numbers.json.  A load may differ by 1e-9 (relative to loads greater
than one), or by its recorded error bar where that is larger; kinds and indices may not differ at all.  Status 0 where
all agree.  It needs Python and an engine with the commands of docker, nothing else.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

HOME = Path(__file__).resolve().parents[1]
RECORD = HOME / "tests" / "golden" / "numbers.json"
CASE = "demo cord"
ARGUMENTS = "--range 60 8 --depth 1 --elements 8 --degree 6 --no-figures"
"""Those of the record: a coarser mesh would have other numbers, within its error bars."""
DEMO = f"python demos/cord.py {ARGUMENTS} --output /tmp/cord >&2 && cat /tmp/cord/diagram.json"
"""The recorded run of the demo, which writes its diagram on standard output, and all else on standard error."""
ALLOWED = 1e-9
"""Difference of a load, relative to loads greater than one."""


def main() -> int:
    """Build, run, compare; returns the status for the shell."""
    asked = arguments()
    if not asked.no_build:
        subprocess.run([asked.engine, "build", "--tag", asked.tag, *asked.options, str(HOME)], check=True)
    ran = subprocess.run(
        [asked.engine, "run", "--rm", "--network", "none", asked.tag, "sh", "-c", DEMO],
        check=True, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    lines, agree = compared(json.loads(ran.stdout), json.loads(RECORD.read_text())[CASE])
    print(*lines, "all agree" if agree else "NOT the recorded numbers", sep="\n")
    return 0 if agree else 1


def arguments() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--engine", default="docker", help="program with the commands of docker: docker, podman")
    parser.add_argument("--tag", default="rodfem", help="name of the image (%(default)s)")
    parser.add_argument("--no-build", action="store_true", help="the image is there")
    parser.add_argument("options", nargs="*", help="options of the engine's build, after --")
    return parser.parse_args()


def compared(diagram: dict[str, Any], recorded: list[dict[str, Any]]) -> tuple[list[str], bool]:
    """A line for each recorded special point, and whether all agree.

    ``diagram`` is what a run's diagram.json has, ``recorded`` the branches of its record.
    """
    lines, agree = [], [b["name"] for b in diagram["branches"]] == [b["name"] for b in recorded]
    for found, old in zip(diagram["branches"], recorded, strict=False):
        agree &= len(found["special"]) == len(old["special"])
        for s, t in zip(found["special"], old["special"], strict=False):
            allowed = max(t["bar"], ALLOWED * max(1.0, abs(t["load"])))
            same = abs(s["load"] - t["load"]) <= allowed and words(s) == words(t)
            agree &= same
            lines.append(
                f"{old['name']:<10}{t['kind']:<14}{s['load']:<22.13g}recorded {t['load']:<22.13g}"
                f"{'same' if same else 'DIFFERENT'}: {abs(s['load'] - t['load']):.1e} of {allowed:.1e} allowed"
            )
    return lines, agree


def words(special: dict[str, Any]) -> tuple[Any, ...]:
    """Kind, index on either side, and number of zero eigenvalues, as a file or the record has them."""
    index = special.get("index") or [special["negative_before"], special["negative_after"]]
    return special["kind"], *index, special["zero"]


if __name__ == "__main__":
    sys.exit(main())
