"""What a type checker, ``help`` and the interpreter's start make of the package from outside."""

import pydoc
import re
import subprocess
import sys
import venv
from pathlib import Path

import pytest

import rodfem

HOME = Path(__file__).parents[2]
HEAVY = ("dolfinx", "matplotlib", "mpi4py", "petsc4py", "slepc4py", "pyvista")
UNUSED = (
    *("pkg_resources", "setuptools", "ffcx.compiler", "matplotlib", "pyvista", "jinja2"),
    *("scipy.optimize", "scipy.interpolate", "scipy.spatial", "scipy.integrate"),
)
"""Modules that a run without pictures does not need, each a part of the time that a person waits for it."""


def test_no_public_name_is_a_module() -> None:
    """``import rodfem.name`` would put the module in the place of the name."""
    modules = {path.stem for path in (HOME / "rodfem").glob("*.py")} | {
        path.parent.name for path in (HOME / "rodfem").glob("*/__init__.py")
    }
    assert not modules & set(rodfem._HOMES)


def installed(folder: Path) -> Path:
    """Python of a new virtual environment in which the package is installed: it has a link to it."""
    venv.create(folder, system_site_packages=True, symlinks=True)
    (packages,) = folder.glob("lib/python*/site-packages")
    (packages / "rodfem").symlink_to(HOME / "rodfem")
    return folder / "bin" / "python"


@pytest.mark.long
def test_types_of_an_installed_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """README and docs/python.md are accepted by ``mypy --strict`` elsewhere, and no public name is ``Any`` there."""
    api = pytest.importorskip("mypy.api", reason="mypy is not installed: `make lint` does that")
    for variable in ("PYTHONPATH", "MYPYPATH"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.chdir(tmp_path)
    pages = "".join((HOME / page).read_text() for page in ("README.md", "docs/python.md"))
    blocks = re.findall(r"```python\n(.*?)```", pages, flags=re.DOTALL)
    Path("readme.py").write_text("".join(blocks))
    revealed = [f"reveal_type(rodfem.{name})" for name in rodfem._HOMES]
    wrong = "rodfem.Parameter('one')"
    Path("names.py").write_text("\n".join(["import rodfem", *revealed, wrong]))
    options = ["--strict", "--config-file=", "--cache-dir=cache", f"--python-executable={installed(tmp_path / 'venv')}"]
    limit = sys.getrecursionlimit()
    out, trouble, _ = api.run([*options, "readme.py", "names.py"])
    sys.setrecursionlimit(limit)  # mypy raises it: a recursion without end, which another test provokes, would crash
    assert not trouble
    assert re.findall(r"^(.*): error: (.*?)  \[", out, flags=re.MULTILINE) == [
        (f"names.py:{len(revealed) + 2}", 'Argument 1 to "Parameter" has incompatible type "str"; expected "float"')
    ]
    types = re.findall('Revealed type is "(.*)"', out)
    assert len(types) == len(revealed)
    assert "Any" not in types
    assert any(shown.endswith("-> rodfem.problem.scene.Scene") for shown in types)


@pytest.mark.parametrize("statement", ["import rodfem", "from rodfem import Ordinate, Parameter, Scene, clamped"])
def test_a_scene_is_stated_without_what_computes_and_draws(statement: str) -> None:
    program = f"{statement}; import sys; print(*sys.modules)"
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=HOME).stdout
    assert "rodfem" in out.split()
    assert not {*HEAVY} & {*out.split()}


@pytest.mark.long
def test_a_run_without_pictures_loads_nothing_else(tmp_path: Path) -> None:
    """Once its forms are compiled; and whoever needs ``pkg_resources`` afterwards has it."""
    words = ["hemitropic", "--no-figures", "--range", "0", "0.05", "--elements", "2", "--degree", "2"]
    program = (
        f"import sys, runpy; sys.argv = {[*words, '--output', str(tmp_path)]!r}; "
        "runpy.run_path('demos/hemitropic.py', run_name='__main__'); print('LOADED', *sys.modules); "
        "import ufl, pkg_resources; print(ufl.__version__ == pkg_resources.get_distribution('fenics-ufl').version)"
    )
    for _ in range(2):  # the first run may compile
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=HOME)
        loaded = done.stdout[done.stdout.index("LOADED") :].split()
        if not {*UNUSED} & {*loaded}:
            break
    assert {"dolfinx", "h5py", "rodfem.app.run"} <= {*loaded}
    assert not {*UNUSED} & {*loaded}
    assert loaded[-1] == "True"


@pytest.mark.few(1)
@pytest.mark.parametrize("order", ["rodfem.Discretization", "rodfem.trace", "rodfem.forms", "rodfem.compat"])
def test_versions_are_known_without_the_package_manager(order: str) -> None:
    """Whatever is loaded first; and any other name of ``pkg_resources`` is that of the real one."""
    first, _, name = order.rpartition(".")
    program = (
        f"import sys; {f'from {first} import {name}' if first else f'import {name}'}; "
        "assert 'pkg_resources' not in sys.modules; from rodfem.forms.importing import without_pkg_resources as w\n"
        "with w():\n    from pkg_resources import parse_version\nimport pkg_resources\n"
        "assert pkg_resources.parse_version is parse_version"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=HOME)


@pytest.mark.long
def test_a_star_brings_all_public_names_and_help_is_short_and_names_all() -> None:
    names: dict[str, object] = {}
    exec("from rodfem import *", names)
    assert set(names) - {"__builtins__"} == set(rodfem._HOMES) and names["Scene"] is rodfem.Scene
    text = pydoc.plain(pydoc.render_doc(rodfem))
    assert len(text.splitlines()) < 300
    assert set(rodfem._HOMES) <= set(re.findall(r"\w+", text[text.index("Public names") :]))
