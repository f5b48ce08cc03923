"""Speed against error: writes ``docs/speed.md`` and its figures; run by ``make bench``."""
