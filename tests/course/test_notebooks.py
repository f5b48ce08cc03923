"""The lessons as notebooks: each runs to its end, and the first cell installs rodfem where it is missing."""

import os
import runpy
import subprocess
import sys
import venv
from importlib.util import find_spec
from pathlib import Path

import pytest

HOME = Path(__file__).parents[2]
NEEDED = ("jupytext", "nbclient", "ipykernel")
OURS = find_spec("dolfinx_solver") is not None
"""Whether the libraries are PyPI's, as in a hosted notebook; Debian's matplotlib does not draw in a new kernel."""

pytestmark = [
    pytest.mark.versions,
    pytest.mark.skipif(not (OURS and all(map(find_spec, NEEDED))), reason='needs pip install ".[pip,notebooks]"'),
]


@pytest.fixture(scope="module")
def notebooks(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    written = runpy.run_path(str(HOME / "tools" / "notebooks.py"))["write"](tmp_path_factory.mktemp("notebooks"))
    assert isinstance(written, list) and len(written) == 11
    return written


def execute(path: Path, python: str) -> subprocess.CompletedProcess[str]:
    """Run a notebook with the kernel of another Python, or of this one; an error in a cell is one of the program."""
    program = (
        "import sys, nbformat, nbclient; book = nbformat.read(sys.argv[1], as_version=4);"
        "nbclient.NotebookClient(book, timeout=600, kernel_name='python3').execute();"
        "print(''.join(o.get('text', '') for c in book.cells for o in c.get('outputs', [])))"
    )
    kernels = str(Path(python).parents[1] / "share" / "jupyter")
    env = os.environ | {"JUPYTER_PATH": kernels, "PATH": f"{Path(python).parent}:{os.environ['PATH']}"}
    env.pop("MPLBACKEND", None)
    return subprocess.run([python, "-c", program, str(path)], env=env, cwd=path.parent, capture_output=True, text=True)


@pytest.mark.parametrize("number", range(11))
def test_a_notebook_runs(number: int, notebooks: list[Path]) -> None:
    done = execute(notebooks[number], sys.executable)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.long
def test_the_first_cell_installs_rodfem(notebooks: list[Path], tmp_path: Path) -> None:
    """In an environment that has notebooks and nothing of rodfem; the wheel is where pip is told to look."""
    make = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(tmp_path / "wheels")]
    subprocess.run([*make, str(HOME)], check=True)
    venv.create(tmp_path / "hosted", with_pip=True)
    python = str(tmp_path / "hosted" / "bin" / "python")
    subprocess.run([python, "-m", "pip", "install", "--quiet", "nbclient", "ipykernel"], check=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PIP_FIND_LINKS", str(tmp_path / "wheels"))
        patch.delenv("PYTHONPATH", raising=False)
        done = execute(notebooks[1], python)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "2.467" in done.stdout  # pi^2/4, the number of lesson 2
