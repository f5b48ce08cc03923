"""Equilibria are p = cos(theta) - eps cot(theta); the largest has sin(theta)^3 = eps."""

eps = 0.01
answer = (1 - eps ** (2 / 3)) ** 1.5  # 0.93 of the perfect column: a hundredth costs seven
