"""The wheel's compiled code: rodfem's own C, wherever a wheel is built and a compiler is found; all else is declared.

Without it the code is compiled when it is first needed, as in an editable installation, which may change it.
"""

import sys
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).resolve().parent
extensions = []
if "bdist_wheel" in sys.argv:
    sys.path.insert(0, str(HERE))
    from rodfem.linalg.compiled import PACKAGE, builder

    for file in sorted(PACKAGE.rglob("*.c")):
        package = ".".join(file.parent.relative_to(HERE).parts)
        extension = builder(str(file.with_suffix("")), f"{package}.").distutils_extension(str(HERE / "build" / "c"))
        extension.optional = True  # without a compiler there is a wheel all the same
        extensions.append(extension)
setup(ext_modules=extensions)
