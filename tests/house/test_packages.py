"""What people install: the wheel and the source distribution have what they should, and the wheel works."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from math import pi
from pathlib import Path

import pytest

import rodfem

HOME = Path(__file__).parents[2]
LEFT = shutil.ignore_patterns(
    *(".git", ".venv", "results", "build", "dist", "__pycache__", "*.egg-info", ".*_cache", ".jupyter_cache")
)
"""What tools leave in a working copy: the patterns of ``.gitignore``, and the repository itself."""
SUFFIXES = {".py", ".pyi", ".c", ".js", ".css", ".html", ".md", ".typed", ""}
"""Ends of the names of the files of the package; licences of what the report contains have none."""


def tracked() -> set[str]:
    """Files of the repository; none where there is none, or no git."""
    if shutil.which("git") is None:
        return set()
    listed = subprocess.run(["git", "-C", str(HOME), "ls-files"], capture_output=True, text=True)
    return set(listed.stdout.splitlines())


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A wheel and a source distribution, made from a copy without what tools left, and that copy."""
    pytest.importorskip("setuptools", minversion="77", reason="`make setup` installs a setuptools that builds wheels")
    folder = tmp_path_factory.mktemp("built")
    tree = Path(shutil.copytree(HOME, folder / "tree", symlinks=True, ignore=LEFT))
    for name in files(tree) - tracked() if tracked() else ():
        if not name.startswith("rodfem/forms/"):
            (tree / name).unlink()  # a person's own
    clean = Path(shutil.copytree(tree, folder / "clean", symlinks=True))
    make = "from setuptools import build_meta as b; print(b.build_sdist({0!r})); print(b.build_wheel({0!r}))"
    made = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", make.format(str(folder))],
        cwd=tree, env=os.environ | {"PYTHONPATH": ""}, capture_output=True, text=True,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    return {"tree": clean, "sdist": next(folder.glob("*.tar.gz")), "wheel": next(folder.glob("*.whl"))}


def files(folder: Path) -> set[str]:
    """Files of a tree; those of ``forms`` also by the link to it in ``rodfem``."""
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    return found | {f"rodfem/{name}" for name in found if name.startswith("forms/")}


@pytest.mark.long
def test_wheel_is_the_package_and_its_licence(built: dict[str, Path]) -> None:
    with zipfile.ZipFile(built["wheel"]) as wheel:
        found = {name for name in wheel.namelist() if not name.endswith("/")}
        about = {name for name in found if ".dist-info/" in name}
        metadata = wheel.read(next(name for name in about if name.endswith("/METADATA"))).decode()
        points = wheel.read(next(name for name in about if name.endswith("/entry_points.txt"))).decode()
    tree = built["tree"]
    compiled = {name for name in found if name.endswith(".so")}
    assert found - about - compiled == {name for name in files(tree) if name.startswith("rodfem/")}
    assert sorted(re.sub(r"rodfem_(\w+)_\w+[.].*", r"\1.c", name) for name in compiled) == sorted(
        name for name in found if name.endswith(".c")
    )
    assert {Path(name).suffix for name in found - about - compiled if "/vendor/" not in name} <= SUFFIXES
    # One of each kind that setuptools leaves out unless it is told.
    assert found >= {
        *("rodfem/py.typed", "rodfem/__init__.pyi", "rodfem/linalg/chain.c", "rodfem/forms/rotation.py"),
        *("rodfem/report/static/template.html", "rodfem/report/static/js/main.js"),
        *("rodfem/report/static/vendor/LICENSE-plotly", "rodfem/report/static/vendor/LICENSE-three"),
    }
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in about)
    assert f"\nVersion: {rodfem.__version__}\n" in metadata and "\nLicense-Expression: MIT\n" in metadata
    assert {"viz", "docs", "test"} <= set(re.findall(r"^Provides-Extra: (\w+)$", metadata, flags=re.M))
    assert "rodfem = rodfem.app.console:main" in points


def test_source_distribution_is_the_repository(built: dict[str, Path]) -> None:
    with tarfile.open(built["sdist"]) as sdist:
        found = {member.name.partition("/")[2] for member in sdist if member.isfile()}
    added = {name for name in found if name in ("PKG-INFO", "setup.cfg") or name.startswith("rodfem.egg-info/")}
    assert found - added == files(built["tree"])


def test_wheel_in_a_bare_environment_runs_an_example(built: dict[str, Path], tmp_path: Path) -> None:
    """The cord of docs/python.md, by a Python that has dolfinx and the wheel alone, in a folder of its own."""
    venv.create(tmp_path / "bare", system_site_packages=True, symlinks=True)
    python = tmp_path / "bare" / "bin" / "python"
    subprocess.run(
        [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--disable-pip-version-check",
         "--no-index", "--no-deps", str(built["wheel"])], check=True, cwd=tmp_path,
    )  # fmt: skip
    page = (HOME / "docs" / "python.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    cord = next(block for block in blocks if 'name="cord"' in block)
    cord = re.sub(r"^picture = .*$", "", cord, flags=re.M)  # needs the extra viz
    (tmp_path / "example.py").write_text(cord + "\nprint(rodfem.__file__)\n")
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "OMPI_", "PMIX"))
    }
    said = subprocess.run(
        [python, "example.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
    )
    assert said.returncode == 0, said.stderr
    assert said.stdout.splitlines()[-1].startswith(str(tmp_path / "bare"))
    bound = re.search(r"^ +([\d.]+) \([^)]*\) +9\.0+ ", said.stdout, flags=re.M)  # of stability, where k0 = 9
    assert bound and abs(float(bound[1]) - (81 - 4 * pi**2)) < 1e-8
    version = subprocess.run([python.parent / "rodfem", "--version"], capture_output=True, text=True, env=environment)
    assert version.stdout.startswith(f"rodfem  {rodfem.__version__}\n"), version.stderr


def test_test_files_have_names_of_their_own() -> None:
    """Tests are no package: of two files with one name pytest refuses the second."""
    names = [path.name for path in (HOME / "tests").rglob("test_*.py")]
    assert sorted(set(names)) == sorted(names)


@pytest.mark.parametrize(("given", "said"), [((), "takes one argument"), (("viz,tset",), "no extra 'tset'")])
def test_setup_without_an_extra_that_exists(given: tuple[str, ...], said: str) -> None:
    """One sentence, which names all there are, before anything is installed."""
    extras = tomllib.loads((HOME / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    done = subprocess.run(["tools/setup.sh", *given], cwd=HOME, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert said in done.stderr and done.stderr.endswith(f": choose from {' '.join(extras)}.\n")
