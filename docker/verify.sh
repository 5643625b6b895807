#!/bin/sh
# Builds docker/Dockerfile and runs the program in it, without a Docker engine, for several Debian releases; then
# compares what they computed.
# Usage: docker/verify.sh [bookworm|trixie|sid ...]        (as root; default: bookworm trixie)
#        docker/verify.sh compare                          only the comparison of what was computed before
#
# What is verified is the last commit.  Per release: debootstrap makes the base image, buildah builds (isolation chroot:
# works inside containers too), and in the image, as a user whom it does not know, run `dolfbuoy doctor`, `dolfbuoy run
# short --t-end 5` on one and on two ranks, and the tests; then the pages in chromium, which the image leaves out.  What a
# release has passed at this commit is not repeated.
#
# Needs: apt-get install --no-install-recommends debootstrap buildah podman git; the network; 3 GB of disk per release.
# WORK    working folder [/var/tmp/dolfbuoy-verify]; may be deleted
# MIRROR  Debian mirror [the first one of this machine's apt sources]
# TESTS   arguments of pytest; "none" leaves the tests out
# DRIVER  storage driver [overlay where the kernel lets root mount it, else vfs: without layers, more disk]
set -eu

root=$(cd -- "$(dirname -- "$0")/.." && pwd -P)
WORK=${WORK:-/var/tmp/dolfbuoy-verify}
MIRROR=${MIRROR:-$(cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
    sed -n 's/^URIs: *//p; s/^deb \(\[[^]]*\] \)\{0,1\}\([^ ]*\).*/\2/p' | head -n 1)}
TESTS=${TESTS:-}
tolerance=1e-8
stranger=12345:12345 # a caller without an entry in the image's /etc/passwd

say() { printf '%s\n' "verify: $*"; }
die() { printf '%s\n' "verify: $*" >&2; exit 1; }

[ "$(id -u)" -eq 0 ] || die "needs root"
for tool in debootstrap podman buildah git; do
    command -v $tool >/dev/null || die "$tool is missing: apt-get install --no-install-recommends debootstrap buildah podman git"
done
[ $# -gt 0 ] || set -- bookworm trixie
for release; do
    case $release in bookworm | trixie | sid | compare) ;; *) die "unknown release $release: bookworm, trixie or sid" ;; esac
done
mkdir -p "$WORK"
exec 9>"$WORK/lock"
flock -n 9 || die "another verification is running in $WORK"

can_overlay() {
    rm -rf "$WORK/try"
    mkdir -p "$WORK/try/lower" "$WORK/try/upper" "$WORK/try/work" "$WORK/try/merged"
    mount -t overlay -o "lowerdir=$WORK/try/lower,upperdir=$WORK/try/upper,workdir=$WORK/try/work" none \
        "$WORK/try/merged" 2>/dev/null && umount "$WORK/try/merged"
}
[ -n "${DRIVER:-}" ] || { can_overlay && DRIVER=overlay || DRIVER=vfs; }
storage="--root $WORK/$DRIVER --runroot $WORK/$DRIVER-run --storage-driver $DRIVER" # apart from the machine's own images
# shellcheck disable=SC2086  # a list of options
buildah() { command buildah $storage "$@"; }
# shellcheck disable=SC2086
podman() { command podman $storage "$@"; }

# ---- how this machine reaches the network: proxies, certificates, the index of Python packages.  For the build only.

host_network() {
    mkdir -p "$WORK/host"
    apt-config dump | grep -E '^Acquire::(https?::(Proxy|Timeout)|Retries|Check-Date|Check-Valid-Until|ForceIPv)' \
        >"$WORK/host/apt.conf" || true
    {
        echo "[global]"
        for key in index-url proxy trusted-host; do
            name=PIP_$(echo $key | tr a-z- A-Z_)
            value=$(printenv "$name" || python3 -m pip config get "global.$key" 2>/dev/null || true)
            [ -z "$value" ] || echo "$key = $value"
        done
        echo "cert = /run/host-certificates.crt"
    } >"$WORK/host/pip.conf"
    cat "${PIP_CERT:-/etc/ssl/certs/ca-certificates.crt}" >"$WORK/host/certificates.crt"
}

# ---- the base image, much like the official one: minimal, without documentation

base_image() {
    release=$1 base=$WORK/base-$1
    if podman image exists "docker.io/library/debian:$release-slim"; then return; fi
    say "$release: debootstrap"
    rm -rf --one-file-system "$base"
    mkdir -p "$WORK/debs"
    debootstrap --variant=minbase --cache-dir="$WORK/debs" "$release" "$base" "$MIRROR" >"$WORK/base-$release.log" 2>&1 ||
        { tail -n 20 "$WORK/base-$release.log" >&2; die "debootstrap failed, see $WORK/base-$release.log"; }
    echo "deb $MIRROR $release main" >"$base/etc/apt/sources.list"
    if [ "$release" != sid ]; then
        echo "deb $MIRROR $release-updates main" >>"$base/etc/apt/sources.list"
        echo "deb ${MIRROR%/debian}/debian-security $release-security main" >>"$base/etc/apt/sources.list"
    fi
    echo force-unsafe-io >"$base/etc/dpkg/dpkg.cfg.d/speed"
    printf 'path-exclude /usr/share/%s/*\n' doc man info locale >"$base/etc/dpkg/dpkg.cfg.d/slim"
    for folder in doc man info locale; do rm -rf "${base:?}/usr/share/$folder"; done
    rm -rf "$base"/var/cache/apt/* "$base"/var/lib/apt/lists/* "$base"/var/log/bootstrap.log
    tar -C "$base" --one-file-system --numeric-owner -cf - . |
        podman import --quiet - "docker.io/library/debian:$release-slim" >/dev/null
    rm -rf --one-file-system "$base"
}

# ---- the tree that is verified: the last commit, whatever is being changed meanwhile

commit=$(git -C "$root" rev-parse HEAD) || die "$root is not a git repository"
[ -z "$(git -C "$root" status --porcelain)" ] || say "what is not committed is not verified"
results=$WORK/results/$(git -C "$root" rev-parse --short=12 HEAD)

source_tree() {
    rm -rf "$WORK/source"
    mkdir -p "$WORK/source" "$results"
    git -C "$root" archive "$commit" | tar -C "$WORK/source" -xf -
}

build() {
    release=$1
    say "$release: building the image"
    [ "$DRIVER" = vfs ] && layers=false || layers=true
    buildah bud --isolation chroot --pull-never --layers="$layers" --build-arg "DEBIAN=$release" \
        --build-arg "REVISION=$commit" \
        --volume "$WORK/host/apt.conf:/etc/apt/apt.conf.d/99host:ro" \
        --volume "$WORK/host/pip.conf:/etc/pip.conf:ro" \
        --volume "$WORK/host/certificates.crt:/run/host-certificates.crt:ro" \
        --file "$WORK/source/docker/Dockerfile" --tag "dolfbuoy:$release" "$WORK/source" >"$WORK/build-$release.log" 2>&1 ||
        { tail -n 30 "$WORK/build-$release.log" >&2; die "the build failed, see $WORK/build-$release.log"; }
}

# ---- in the image

# open_image RELEASE HOST_FOLDER: a container of the image, the folder of this machine mounted as /results
open_image() {
    container=$(buildah from --pull-never "dolfbuoy:$1") mounted=$2
    entry=$(buildah inspect --type image --format '{{range .OCIv1.Config.Entrypoint}}{{.}} {{end}}' "dolfbuoy:$1")
}

close_image() { buildah rm "$container" >/dev/null; }

# in_image FOLDER COMMAND...: COMMAND in the container, FOLDER of the container as working directory
in_image() {
    place=$1
    shift
    buildah run --isolation chroot --user "$stranger" --workingdir "$place" \
        --volume "$mounted:/results" "$container" -- "$@"
}

# Pages are tested in a browser that the image leaves out: it goes into this container only, by the host's way out.
add_chromium() {
    buildah run --isolation chroot --user root \
        --volume "$WORK/host/apt.conf:/etc/apt/apt.conf.d/99host:ro" \
        --volume "$WORK/host/certificates.crt:/run/host-certificates.crt:ro" "$container" -- \
        sh -c 'apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install --no-install-recommends chromium'
}

forms() { in_image / find /var/cache/dolfbuoy -name '*.c' | LC_ALL=C sort; }

# attempt NAME RELEASE COMMAND...: run it with its output in a log; a failure is noted and does not stop the others
attempt() {
    log=$WORK/$1-$2.log note=$1-$2
    shift 2
    "$@" >"$log" 2>&1 && return
    tail -n 20 "$log" >&2
    say "FAILED: $note, see $log"
    failed="$failed $note"
    return 1
}

check() {
    release=$1 before=$failed folder=$results/$1
    rm -rf "$folder"
    mkdir -p "$folder"
    chown "$stranger" "$folder"
    open_image "$release" "$folder"

    say "$release: dolfbuoy doctor"
    # shellcheck disable=SC2086  # the entry point, a list of words
    attempt doctor "$release" in_image /results $entry doctor || true
    say "$release: dolfbuoy run short --t-end 5"
    forms >"$WORK/forms-before"
    # shellcheck disable=SC2086
    attempt run "$release" in_image /results $entry run short --t-end 5 --out short || true
    forms >"$WORK/forms-after"
    attempt warm-cache "$release" cmp "$WORK/forms-before" "$WORK/forms-after" || true
    attempt owner "$release" test "$(stat -c %u:%g "$folder/short/results.nc")" = "$stranger" || true
    say "$release: the same on two ranks"
    attempt two "$release" in_image /results mpirun -n 2 dolfbuoy run short --t-end 5 --no-plot --out two || true
    if [ "$TESTS" != none ]; then
        say "$release: tests"
        # shellcheck disable=SC2086  # a list of arguments
        attempt tests "$release" in_image /opt/dolfbuoy env HYPOTHESIS_STORAGE_DIRECTORY=/tmp/hypothesis \
            pytest -q -p no:cacheprovider -n logical --dist worksteal $TESTS || true
        tail -n 1 "$WORK/tests-$release.log" | tee "$folder/tests"
        say "$release: tests in chromium"
        attempt chromium "$release" add_chromium || true
        attempt browser "$release" in_image /opt/dolfbuoy env HYPOTHESIS_STORAGE_DIRECTORY=/tmp/hypothesis \
            pytest -q -p no:cacheprovider -m browser tests/program/test_page_browser.py || true
        tail -n 1 "$WORK/browser-$release.log" | tee -a "$folder/tests"
    fi
    close_image
    if [ "$failed" = "$before" ] && [ -z "$TESTS" ]; then touch "$folder/passed"; fi
}

# ---- every record of this commit against the first one, relative to the size of each variable

compare() {
    image=$(podman images --format '{{.Repository}}:{{.Tag}}' | sed -n 's|^localhost/dolfbuoy:||p' | head -n 1)
    if [ -z "$image" ] || [ ! -d "$results" ]; then die "nothing was computed yet at this commit"; fi
    open_image "$image" "$results"
    in_image /results python - "$tolerance" <<'PYTHON' >"$WORK/comparison.md" && status=0 || status=1
import pathlib
import sys

import numpy as np
import xarray as xr

EFFORT = {"newton_iterations", "time_step"}  # rounding decides whether the last iteration was needed
tolerance, reference, worst = float(sys.argv[1]), None, 0.0
print("| Debian | ranks | dolfinx | PETSc | Python | steps | largest difference | of |\n|" + 8 * "---|")
paths = sorted(pathlib.Path().glob("*/*/results.nc"))
for path in paths:
    with xr.open_dataset(path, decode_times=False) as record:
        values = {n: v.values for n, v in record.variables.items() if n not in EFFORT and v.dtype.kind == "f"}
        versions = [record.attrs[f"version_{name}"] for name in ("dolfinx", "petsc", "python")]
        ranks = record.attrs["ranks"]
    if reference is None:
        reference, cells = values, ["reference", ""]
    elif {n: v.shape for n, v in values.items()} != {n: v.shape for n, v in reference.items()}:
        cells, worst = ["other variables or times", ""], np.inf
    else:
        found = {n: abs(values[n] - x).max() / (abs(x).max() or 1.0) for n, x in reference.items()}
        name = max(found, key=found.get)
        cells, worst = [f"{found[name]:.1e}", name], np.max([worst, *found.values()])
    print("|", " | ".join([path.parts[0], str(ranks), *versions, str(len(values["time"]) - 1), *cells]), "|")
if len(paths) < 2:
    sys.exit(f"{len(paths)} record: nothing to compare")
print(f"largest difference {worst:.1e}, allowed {tolerance:.0e}:", "the same" if worst <= tolerance else "NOT THE SAME")
sys.exit(not worst <= tolerance)
PYTHON
    close_image
    cat "$WORK/comparison.md"
    return "$status"
}

failed=
buildah rm --all >/dev/null 2>&1 || true # what an interrupted verification left
if [ "$1" != compare ]; then
    host_network
    source_tree
    for release; do
        if [ -f "$results/$release/passed" ]; then
            say "$release: passed before at this commit: $(cat "$results/$release/tests")"
            continue
        fi
        base_image "$release"
        build "$release"
        check "$release"
    done
fi
compare || failed="$failed comparison"
[ -z "$failed" ] || die "failed:$failed"
say "all passed"
