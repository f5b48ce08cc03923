#!/bin/sh
# Runs the tests serially (in two processes, each file in one of them), on two ranks, and those marked `short` on three;
# stops at the first run that fails.
#
#     tools/test.sh PYTHON MPIRUN SECONDS [options for pytest]        (as `make test` does)
#
# Those marked `long` run with all=yes in the environment only.  Two ranks do without the tests marked `alone` that are not
# `short`.  With quick=yes there are only the tests marked `versions`: serially, and of them on two ranks what two ranks run.
set -eu
cd "$(dirname "$0")/.."
marks="(short or not alone) and not long" shortest="short and not long" serial="not long"
[ "${all-}" != yes ] || marks="short or not alone" shortest=short serial=
[ "${quick-}" != yes ] || marks="versions and ($marks)" serial="versions and not long"
python=$1 mpirun=$2 limit=$3
shift 3

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
export logs

# What each rank of Open MPI or MPICH does: rank 0 prints, the others write into a file, shown below if the run fails.
rank='rank=${OMPI_COMM_WORLD_RANK-$PMI_RANK}; [ "$rank" = 0 ] || exec >"$logs/rank-$rank" 2>&1; exec "$@"'

run() {
    title=$1
    shift
    echo "== The tests $title"
    status=0
    timeout --foreground -k 10 "$limit" "$@" </dev/null || status=$?
    [ $status = 0 ] && return
    for log in "$logs"/*; do
        [ ! -s "$log" ] || { echo "== ${log##*/}"; tail -n 100 "$log"; }
    done
    [ $status != 124 ] || echo "== Stopped after $limit s (make test LIMIT=... for more). Do ranks wait for each other?"
    echo "== FAILED: the tests $title"
    exit $status
}

run "serially, in two processes" "$python" -m pytest -n 2 --dist loadfile -m "$serial" "$@"
ranks() { # ranks NUMBER MARKS [options for pytest]
    number=$1 chosen=$2
    shift 2
    run "on $number ranks ($chosen)" $mpirun -n "$number" sh -c "$rank" sh "$python" -m pytest --color=no \
        -p no:cacheprovider -m "$chosen" "$@"
}
ranks 2 "$marks" "$@"
[ "${quick-}" = yes ] || ranks 3 "$shortest" "$@"
echo "== Passed"
