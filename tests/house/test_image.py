"""``tools/image.py`` agrees with the record itself, and sees a digit, an index and a branch that are others."""

import copy
import json
import runpy
from pathlib import Path
from typing import Any

image = runpy.run_path(str(Path(__file__).parents[2] / "tools" / "image.py"))
RECORDED = json.loads(image["RECORD"].read_text())[image["CASE"]]


def test_the_record_agrees_and_other_numbers_are_seen() -> None:
    diagram: dict[str, Any] = {"branches": copy.deepcopy(RECORDED)}
    for special in (s for branch in diagram["branches"] for s in branch["special"]):
        special["negative_before"], special["negative_after"] = special.pop("index")
    lines, agree = image["compared"](diagram, RECORDED)
    assert agree and len(lines) == sum(len(branch["special"]) for branch in RECORDED)
    first = diagram["branches"][0]["special"][0]
    for change in ({"load": first["load"] * (1 + 2e-9)}, {"negative_after": 2}, {"kind": "fold"}, {"zero": 2}):
        changed = copy.deepcopy(diagram)
        changed["branches"][0]["special"][0] |= change
        assert not image["compared"](changed, RECORDED)[1], change
    del diagram["branches"][-1]
    assert not image["compared"](diagram, RECORDED)[1]
