"""Results of many scenes in a few lines."""

from collections import Counter
from collections.abc import Sequence
from typing import Any


def in_words(entries: Sequence[dict[str, Any]]) -> str:
    """Numbers of scenes, rows, special points, and how well error bars hold."""
    outcomes = Counter(entry["outcome"] for entry in entries)
    rows, unclear = (sum(entry.get(name, 0) for entry in entries) for name in ("rows", "unclear"))
    ratios = sorted(ratio for entry in entries for ratio in entry.get("ratios", ()))
    within = sum(ratio <= 1 for ratio in ratios)
    wrong = [e for e in entries if e.get("wrong")]
    differ = [e for e in entries if e.get("differs")]
    lines = [
        f"{len(entries)} scenes: " + ", ".join(f"{count} {name}" for name, count in outcomes.most_common()),
        f"{rows} rows counted densely ({unclear} too near a critical state), {len(wrong)} scenes with wrong ones",
        f"{len(ratios)} pairs of special points, {sum(e.get('unresolved', 0) for e in entries)} of which a mesh says "
        "that it does not resolve them besides",
        f"{len(differ)} scenes differ, {sum(bool(e.get('silent')) for e in differ)} of them without a word",
    ]
    if ratios:
        share = within / len(ratios)
        lines.append(
            f"{share:.2%} are within the sum of their bars; the largest ratios: "
            + ", ".join(f"{ratio:.3g}" for ratio in ratios[:-6:-1])
        )
    for entry in entries:
        for name in ("wrong", "differs", "trace"):
            if entry.get(name) and (name != "differs" or entry.get("silent")):
                lines.append(f"  seed {entry['seed']}, scene {entry['number']}: {name}: {entry[name][-1]}")
    return "\n".join(lines)
