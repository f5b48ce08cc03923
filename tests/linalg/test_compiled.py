"""Compiled modules export no name, and what they keep pointers to lives as long."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from ffcx.codegeneration import jit
from hard.test_environments import form

from rodfem import code_cache, compat
from rodfem.linalg import compiled

pytestmark = pytest.mark.versions
NAMES = [str(file.relative_to(compiled.PACKAGE).with_suffix("")) for file in compiled.PACKAGE.rglob("*.c")]


def exported(file: str | Path) -> list[str]:
    """Names that the dynamic linker finds in a module, but for those of the linker itself."""
    if shutil.which("nm") is None:
        pytest.skip("needs nm")
    said = subprocess.run(["nm", "-D", "--defined-only", str(file)], capture_output=True, text=True, check=True).stdout
    names = {line.split()[-1] for line in said.splitlines()}
    return sorted(names - {"_init", "_fini", "__bss_start", "_edata", "_end"})


@pytest.mark.parametrize("name", NAMES)
def test_a_module_exports_its_init_function_alone(name: str) -> None:
    """Of two functions with one name in a process the dynamic linker would take the first, whoever calls."""
    module = compiled.module(name)
    assert exported(module.__file__) == [f"PyInit_{module.__name__}"]


def test_so_do_those_of_forms(tmp_path: Path) -> None:
    jit.compile_forms([form()], cache_dir=tmp_path, **next(iter(compat.C_COMPILER.values())))
    (made,) = (file for file in tmp_path.iterdir() if file.suffix == ".so")
    name = made.name.partition(".")[0]
    assert exported(made) == [f"PyInit_{name}"]
    damaged = tmp_path / f"damaged{made.suffix}"
    damaged.write_bytes(made.read_bytes()[:99])
    assert code_cache.load(name, damaged) is None and not damaged.exists()  # so that it is compiled anew


@pytest.mark.parametrize("values", [np.zeros(3, dtype=np.float32), np.arange(3, dtype=np.int64), np.zeros((4, 4))[::2]])
def test_arrays_that_c_would_read_wrongly_are_refused(values: np.ndarray) -> None:
    with pytest.raises(ValueError):
        compiled.buffer(compiled.module("linalg/chain").ffi, values)
