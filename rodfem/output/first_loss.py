"""First loss of stability along the first branch of a diagram, in words."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

from rodfem.continuation.kinds import KINDS
from rodfem.output.digits import number
from rodfem.output.summary import called


def first_loss(data: Mapping[str, Any]) -> str:
    """Kind and load of the first special point on the first branch from which on it is unstable, with its accuracy.

    Of a planar rod it is the loss of stability in the plane, and the words say so.
    """
    if not data["branches"]:
        return "no branches"
    branch = data["branches"][0]
    columns = branch["columns"]
    plane = " in the plane" if data.get("planar") else ""
    if branch.get("singular_start"):
        return "the first state is singular"
    if columns["negative"][0]:
        return f"unstable{plane} from the first state on"
    for row in sorted([x["row"] for x in branch.get("unexplained") or ()])[:1]:
        before = [x for x in branch["special"] if x["row"] <= row and _loses(x)]
        if not before:
            return f"unknown: the index changes near {data['parameter']} = {columns['load'][row]:.6g} unexplained"
    lost = next((special for special in branch["special"] if _loses(special)), None)
    if lost is not None:
        bar = lost.get("error_estimate")
        load = number(lost["load"], inf if bar is None else bar, lost.get("resolved"))
        return f"{lost['kind']}{plane} at {data['parameter']} = {load}"
    if any(columns["negative"]):
        return f"unstable{plane} somewhere, without a special point"
    ends = f"from {columns['load'][0]:.6g} to {columns['load'][-1]:.6g}"
    return f"none{plane}: {called(branch['name'])} is stable {ends}"


def _loses(special: Mapping[str, Any]) -> bool:
    return not KINDS[special["kind"]].given and not special["negative_before"] and bool(special["negative_after"])
