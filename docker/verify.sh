#!/bin/sh
# Builds docker/Dockerfile and runs the program in it, without a Docker engine, for several Debian releases; then
# compares what they computed.
# Usage: docker/verify.sh [bookworm|trixie|sid ...]        (as root; default: bookworm trixie)
#
# Per release: debootstrap makes the base image, buildah builds (isolation chroot, storage driver vfs: works inside
# containers too), and in the image, as a user whom it does not know, run the tests and `dolfbuoy run short --t-end 5`.
# Results of earlier calls stay; those of the same program are compared too.
#
# Needs: apt-get install --no-install-recommends debootstrap buildah podman; the network; 10 GB of disk per release.
# WORK    working folder [/var/tmp/dolfbuoy-verify]; may be deleted
# MIRROR  Debian mirror [the first one of this machine's apt sources]
# TESTS   arguments of pytest; "none" leaves the tests out
# DRIVER  storage driver [vfs]; where the kernel lets root mount it, "overlay" needs less disk and keeps layers
set -eu

root=$(cd -- "$(dirname -- "$0")/.." && pwd -P)
WORK=${WORK:-/var/tmp/dolfbuoy-verify}
MIRROR=${MIRROR:-$(cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
    sed -n 's/^URIs: *//p; s/^deb \(\[[^]]*\] \)\{0,1\}\([^ ]*\).*/\2/p' | head -n 1)}
TESTS=${TESTS:-}
DRIVER=${DRIVER:-vfs}
tolerance=1e-8
stranger=12345:12345 # a caller without an entry in the image's /etc/passwd

say() { printf '%s\n' "verify: $*"; }
die() { printf '%s\n' "verify: $*" >&2; exit 1; }

[ "$(id -u)" -eq 0 ] || die "needs root"
for tool in debootstrap podman buildah; do
    command -v $tool >/dev/null || die "$tool is missing: apt-get install --no-install-recommends debootstrap buildah podman"
done
[ $# -gt 0 ] || set -- bookworm trixie
for release; do
    case $release in bookworm | trixie | sid) ;; *) die "unknown release $release: bookworm, trixie or sid" ;; esac
done

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

build() {
    release=$1
    say "$release: building the image"
    [ "$DRIVER" = vfs ] && layers=false || layers=true
    buildah bud --isolation chroot --pull-never --layers="$layers" --build-arg "DEBIAN=$release" \
        --build-arg "REVISION=$(git -C "$root" rev-parse HEAD 2>/dev/null || true)" \
        --volume "$WORK/host/apt.conf:/etc/apt/apt.conf.d/99host:ro" \
        --volume "$WORK/host/pip.conf:/etc/pip.conf:ro" \
        --volume "$WORK/host/certificates.crt:/run/host-certificates.crt:ro" \
        --file "$root/docker/Dockerfile" --tag "dolfbuoy:$release" "$root" >"$WORK/build-$release.log" 2>&1 ||
        { tail -n 30 "$WORK/build-$release.log" >&2; die "the build failed, see $WORK/build-$release.log"; }
}

# in_image FOLDER COMMAND...: COMMAND in the container, FOLDER of the container as working directory
in_image() {
    folder=$1
    shift
    buildah run --isolation chroot --user "$stranger" --workingdir "$folder" \
        --volume "$results:/results" "$container" -- "$@"
}

check() {
    release=$1 results=$WORK/results/$program/$1
    rm -rf "$results"
    mkdir -p "$results"
    chown "$stranger" "$results"
    container=$(buildah from --pull-never "dolfbuoy:$release")
    if [ "$TESTS" != none ]; then
        say "$release: tests"
        # shellcheck disable=SC2086  # a list of arguments
        in_image /opt/dolfbuoy env HYPOTHESIS_STORAGE_DIRECTORY=/tmp/hypothesis pytest -q -p no:cacheprovider $TESTS \
            >"$WORK/tests-$release.log" 2>&1 || failed="$failed tests-$release"
        tail -n 1 "$WORK/tests-$release.log" | tee "$results/tests"
    fi
    say "$release: dolfbuoy doctor"
    in_image /results dolfbuoy doctor >"$WORK/doctor-$release.log" 2>&1 ||
        { tail -n 5 "$WORK/doctor-$release.log"; failed="$failed doctor-$release"; }
    say "$release: dolfbuoy run short --t-end 5"
    in_image /results dolfbuoy run short --t-end 5 --out short >"$WORK/run-$release.log" 2>&1 ||
        { tail -n 20 "$WORK/run-$release.log" >&2; die "the run failed, see $WORK/run-$release.log"; }
    say "$release: the same on two ranks"
    in_image /results mpirun -n 2 dolfbuoy run short --t-end 5 --no-plot --out two >>"$WORK/run-$release.log" 2>&1 ||
        { tail -n 20 "$WORK/run-$release.log" >&2; die "the run failed, see $WORK/run-$release.log"; }
    buildah rm "$container" >/dev/null
}

# Every record of this program against the first one, relative to the size of each variable.
compare() {
    container=$(buildah from --pull-never "dolfbuoy:$1") results=$WORK/results/$program
    in_image /results python - "$tolerance" <<'PYTHON' && status=0 || status=1
import pathlib
import sys

import numpy as np
import xarray as xr

tolerance, names = float(sys.argv[1]), ["buoy_position", "tension_top"]
print("| Debian | ranks | dolfinx | PETSc | Python | steps |", " | ".join(names), "|\n|" + 8 * "---|")
reference, worst = None, 0.0
for path in sorted(pathlib.Path().glob("*/*/results.nc")):
    with xr.open_dataset(path) as record:
        values = {name: record[name].values for name in ["time", *names]}
        versions = [record.attrs[f"version_{name}"] for name in ("dolfinx", "petsc", "python")]
        ranks = record.attrs["ranks"]
    if reference is None:
        reference, cells = values, ["reference"] * len(names)
    elif values["time"].shape != reference["time"].shape:
        cells, worst = ["other times"] * len(names), np.inf
    else:
        differences = [abs(values[n] - reference[n]).max() / abs(reference[n]).max() for n in names]
        cells, worst = [f"{d:.1e}" for d in differences], np.max([worst, *differences])
    print("|", " | ".join([path.parts[0], str(ranks), *versions, str(len(values["time"])), *cells]), "|")
print(f"largest difference {worst:.1e}, allowed {tolerance:.0e}:", "the same" if worst <= tolerance else "NOT THE SAME")
sys.exit(not worst <= tolerance)
PYTHON
    buildah rm "$container" >/dev/null
    return "$status"
}

failed=
program=$(cd "$root" && find dolfbuoy forms meshes -name '*.py' -o -name '*.toml' | LC_ALL=C sort | xargs sha256sum |
    sha256sum | cut -c 1-12)
mkdir -p "$WORK"
host_network
for release; do
    base_image "$release"
    build "$release"
    check "$release"
done
compare "$release" || failed="$failed comparison"
[ -z "$failed" ] || die "failed:$failed"
say "all passed"
