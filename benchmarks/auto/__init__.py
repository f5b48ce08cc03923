"""The rods of the demos, traced with AUTO-07p."""
