"""The rod of the page on another path: a subcritical pitchfork, so that it leaves the helix with a jump."""

import re
from pathlib import Path

import rodfem
from rodfem import Plan

page = Path(__file__).parents[2] / "trades" / "two-grippers.md"
names = {}
exec(re.findall(r"```python\n(.*?)^for ", page.read_text(), flags=re.DOTALL | re.MULTILINE)[0], names)
first = rodfem.trace(names["grippers"](0.65, 0.0), plan=Plan(depth=1)).special("branch point")[0]
answer = first.point.load
print(first.law)
