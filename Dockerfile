# rodfem and all that it needs, on Debian 13.
#
#     docker build -t rodfem .
#     docker run --rm rodfem python -m pytest
#     mkdir -p results
#     docker run --rm -v "$PWD/results:/results" rodfem python demos/hemitropic.py --output /results/hemitropic
#     docker run --rm rodfem mpirun --oversubscribe -n 2 python -m pytest
#
# The user in the container has the number 1000. If yours (id -u) is another one, add --user "$(id -u):$(id -g)"
# to the commands that write into /results.
#
# tools/image.py builds the image, runs demos/cord.py in it, and compares each number with the recorded ones.

# Tried without a container: `pip install ".[pip,viz,tables]"` (README). Not tried: another base, with a dolfinx of its own, as
# the project's images are:
# docker build --build-arg BASE=dolfinx/dolfinx:v0.9.0 .
ARG BASE=debian:trixie-slim
FROM ${BASE}

# The Debian of one day, from which every later build installs the same versions:
# docker build --build-arg SNAPSHOT=20260912T000000Z . The default, none, is the Debian of the day of the build, whose
# versions change with point releases only. BASE is then to be of that day as well (debian:trixie-20260908-slim).
ARG SNAPSHOT=
ARG ARCHIVE=http://snapshot.debian.org/archive

# Only packages.txt first: as long as it stays the same, a new build does not install these again. Where the base has
# a dolfinx, neither Python nor MPI of Debian may come beside it.
COPY packages.txt tools/snapshot.sh /tmp/
RUN if [ -n "$SNAPSHOT" ]; then sh /tmp/snapshot.sh "$ARCHIVE" "$SNAPSHOT"; fi \
    && if python3 -c 'import dolfinx' 2>/dev/null; then other='^(python3-|openmpi)'; else other='^$'; fi \
    && apt-get -qq update \
    && sed 's/#.*//' /tmp/packages.txt | grep -vE "$other" \
        | DEBIAN_FRONTEND=noninteractive xargs apt-get -qq install -y --no-install-recommends >/dev/null \
    && rm -rf /var/lib/apt/lists/* /tmp/packages.txt /tmp/snapshot.sh

# The cache (compiled forms) and the results may be written by any user: see --user above.
RUN useradd --create-home --non-unique --uid 1000 rodfem \
    && chmod 755 /home/rodfem \
    && install -d -o rodfem -m 1777 /home/rodfem/.cache /results \
    && install -d -o rodfem /home/rodfem/rodfem
USER rodfem
WORKDIR /home/rodfem/rodfem
ENV HOME=/home/rodfem \
    XDG_CACHE_HOME=/home/rodfem/.cache \
    MPLCONFIGDIR=/home/rodfem/.cache/matplotlib

# Where pip cannot reach pypi.org directly: docker build --build-arg PIP_INDEX_URL=... (or PIP_CERT).
ARG PIP_INDEX_URL
ARG PIP_CERT

# The same set-up as `make setup`; then the virtual environment's python is the python.
COPY --chown=rodfem:rodfem . .
RUN if [ "$(command -v python3)" != /usr/bin/python3 ] || ! dpkg-query -W python3-dolfinx >/dev/null 2>&1; then \
        export RODFEM_PYTHON="$(command -v python3)"; \
    fi \
    && tools/setup.sh viz,tables,test && rm -rf /home/rodfem/.cache/pip
ENV PATH=/home/rodfem/rodfem/.venv/bin:$PATH

# Pictures without a display; Open MPI on one machine, as in the Makefile.
ENV MPLBACKEND=Agg \
    PYVISTA_OFF_SCREEN=true \
    VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow \
    OMPI_MCA_btl=self,vader \
    HWLOC_HIDE_ERRORS=2 \
    UCX_LOG_LEVEL=fatal \
    OMP_NUM_THREADS=1

# The compiled forms of the demos, which any user may use and add to.
RUN for demo in cord follower hemitropic ring ruler; do \
        python "demos/$demo.py" --no-figures --output /tmp/warm >/tmp/warm.log 2>&1 \
        || { echo "$demo:"; cat /tmp/warm.log; exit 1; }; done \
    && rm -rf /tmp/warm /tmp/warm.log && find /home/rodfem/.cache -type d -exec chmod 1777 {} + \
    && chmod -R a+rX /home/rodfem/.cache

CMD ["python", "-m", "pytest"]
