"""Numbers that do not change while the shape of the code does: ``python -m tests.golden`` records them anew.

It needs ``tests`` and the root of the project on PYTHONPATH.
"""
