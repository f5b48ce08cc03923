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

FROM debian:trixie-slim

# Only packages.txt first: as long as it stays the same, a new build does not install these again.
COPY packages.txt /tmp/
RUN apt-get -qq update \
    && sed 's/#.*//' /tmp/packages.txt \
        | DEBIAN_FRONTEND=noninteractive xargs apt-get -qq install -y --no-install-recommends >/dev/null \
    && rm -rf /var/lib/apt/lists/* /tmp/packages.txt

# The cache (compiled forms) and the results may be written by any user: see --user above.
RUN useradd --create-home --uid 1000 rodfem \
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
RUN tools/setup.sh viz,test && rm -rf /home/rodfem/.cache/pip
ENV PATH=/home/rodfem/rodfem/.venv/bin:$PATH

# Pictures without a display; Open MPI on one machine, as in the Makefile.
ENV MPLBACKEND=Agg \
    PYVISTA_OFF_SCREEN=true \
    VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow \
    OMPI_MCA_btl=self,vader \
    HWLOC_HIDE_ERRORS=2 \
    UCX_LOG_LEVEL=fatal \
    OMP_NUM_THREADS=1

CMD ["python", "-m", "pytest"]
