#!/bin/sh
# Makes rodfem runnable on Debian 12, 13 or sid: system packages, .venv, and rodfem in it. Where nothing is missing
# it does nothing, and needs neither network nor sudo.
#
#     tools/setup.sh EXTRAS        EXTRAS as in pyproject.toml, with commas between: viz,test
#
# Where another Python has a dolfinx of its own (conda, the images of the FEniCS project), RODFEM_PYTHON names it: no
# Debian package is installed then, and .venv sees what that Python sees.
set -eu
cd "$(dirname "$0")/.."

fail() {
    echo "rodfem: $*" >&2
    exit 1
}

# --- what is asked for ------------------------------------------------------------------------------------

known=$(sed -n '/^\[project.optional-dependencies\]/,/^\[tool/s/^\([a-z]*\) = .*/\1/p' pyproject.toml | xargs)
[ $# = 1 ] && [ -n "$1" ] ||
    fail "tools/setup.sh takes one argument, the extras to install with commas between, as in 'tools/setup.sh viz,test': choose from $known."
extras=$1
for extra in $(echo "$extras" | tr , ' '); do
    case " $known " in *" $extra "*) ;; *) fail "there is no extra '$extra' in pyproject.toml: choose from $known." ;; esac
done

# --- Debian packages -------------------------------------------------------------------------------------

system=${RODFEM_PYTHON-}
[ -n "$system" ] || command -v dpkg-query >/dev/null ||
    fail "this needs Debian, which has dolfinx as a package; elsewhere use the Dockerfile, environment.yml or RODFEM_PYTHON."

missing=
for package in $([ -n "$system" ] || sed 's/#.*//' packages.txt); do
    status=$(dpkg-query -W -f '${db:Status-Status} ' "$package" 2>/dev/null) || status=
    case " $status" in *" installed "*) ;; *) missing="$missing $package" ;; esac
done

if [ -n "$missing" ]; then
    if [ "$(id -u)" = 0 ]; then
        sudo=
    elif command -v sudo >/dev/null; then
        sudo=sudo
    else
        fail "these Debian packages are missing, and only root can install them (there is no sudo):$missing"
    fi
    echo "Installing Debian packages, up to 2 GB with what they need:$missing"
    $sudo apt-get -qq update || echo "rodfem: apt-get update failed; going on with the package lists that are there." >&2
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=300 \
        install -y --no-install-recommends $missing ||
        fail "apt-get could not install these Debian packages (see above):$missing"
fi

# --- .venv -------------------------------------------------------------------------------------------------

# By default Debian's python3: another one that is first on PATH (pyenv, conda) cannot see Debian's dolfinx.
system=${system:-/usr/bin/python3}
python=.venv/bin/python

# The stamp tells for what the installation was made: it is repeated when that has changed.
stamp=.venv/rodfem-$extras.stamp
made_for="$(pwd) $(readlink -f $system) $(cat pyproject.toml tools/setup.sh | cksum)"
if [ -x $python ] && [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$made_for" ]; then
    exit 0
fi

$system -c 'import dolfinx' || fail "$system cannot import dolfinx (see above): is python3-dolfinx installed for it?"
[ -e .venv ] || $system -m venv --system-site-packages .venv
# From a virtual environment the new one would see only what lies below it: it is told of that one, too.
$system -c 'import sys, site
if sys.prefix != sys.base_prefix:
    for folder in site.getsitepackages():
        print(f"import site; site.addsitedir({folder!r})")' >"$($python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/system.pth"
$python -c 'import dolfinx' ||
    fail "the python of .venv cannot import the dolfinx of $system (see above): remove .venv and run this again."

# dolfinx, petsc4py and scipy are compiled against the numpy beside them: no other may come into .venv.
$system -c 'import numpy; print("numpy==" + numpy.__version__)' >.venv/constraints.txt

# Needed, but not in pyproject.toml (see there).
$python -c 'import h5py' 2>/dev/null ||
    $python -m pip install --quiet --disable-pip-version-check --constraint .venv/constraints.txt h5py ||
    fail "pip could not install h5py in .venv (see above)."

# As a path, not by setuptools' import hook: type checkers do not see through that.
echo "Installing rodfem[$extras] in .venv"
$python -m pip install --quiet --disable-pip-version-check --constraint .venv/constraints.txt \
    --config-settings editable_mode=compat --editable ".[$extras]" ||
    fail "pip could not install rodfem[$extras] in .venv (see above)."
echo "$made_for" >"$stamp"
echo "rodfem[$extras] is ready: $python"
