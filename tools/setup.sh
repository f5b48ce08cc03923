#!/bin/sh
# Makes rodfem runnable on Debian 12 or 13: system packages, .venv, and rodfem in it. Where nothing is missing
# it does nothing, and needs neither network nor sudo.
#
#     tools/setup.sh EXTRAS        EXTRAS as in pyproject.toml: viz,test, dev or docs
set -eu
cd "$(dirname "$0")/.."
extras=$1

fail() {
    echo "rodfem: $*" >&2
    exit 1
}

# --- Debian packages -------------------------------------------------------------------------------------

command -v dpkg-query >/dev/null ||
    fail "this needs Debian 12 or 13, which have dolfinx as a package; elsewhere use the Dockerfile."

missing=
for package in $(sed 's/#.*//' packages.txt); do
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

# Always Debian's python3: another one that is first on PATH (pyenv, conda) cannot see Debian's dolfinx.
system=/usr/bin/python3
python=.venv/bin/python

# The stamp tells for what the installation was made: it is repeated when that has changed.
stamp=.venv/rodfem-$extras.stamp
made_for="$(pwd) $(readlink -f $system) $(cat pyproject.toml tools/setup.sh | cksum)"
if [ -x $python ] && [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$made_for" ]; then
    exit 0
fi

$system -c 'import dolfinx' || fail "$system cannot import dolfinx (see above), though python3-dolfinx is installed."
[ -e .venv ] || $system -m venv --system-site-packages .venv
$python -c 'import dolfinx' ||
    fail "the python of .venv cannot import Debian's dolfinx (see above): remove .venv and run this again."

# Debian's dolfinx, petsc4py and scipy are compiled against Debian's numpy: no other may come into .venv.
$system -c 'import numpy; print("numpy==" + numpy.__version__)' >.venv/constraints.txt

# As a path, not by setuptools' import hook: type checkers do not see through that.
echo "Installing rodfem[$extras] in .venv"
$python -m pip install --quiet --disable-pip-version-check --constraint .venv/constraints.txt \
    --config-settings editable_mode=compat --editable ".[$extras]" ||
    fail "pip could not install rodfem[$extras] in .venv (see above)."
echo "$made_for" >"$stamp"
echo "rodfem[$extras] is ready: $python"
