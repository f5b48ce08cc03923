"""Commands of the program ``rodfem``: a module each, whose name is the command's.

A module added here is a command.  The first line of its docstring is its line in the list of commands, and ``main``
does the work: it takes the words after the command's name, and raises :class:`~rodfem.errors.InputError` for bad ones.
"""

from pkgutil import iter_modules

COMMANDS = tuple(module.name for module in iter_modules(__path__))
