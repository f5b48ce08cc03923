"""Search for equilibria that no branch connects to those that are known."""
