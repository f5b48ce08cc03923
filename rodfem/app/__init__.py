"""A run from a shell: command line, terminal, many rods."""
