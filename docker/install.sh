#!/bin/sh
# Installs all that dolfbuoy needs: Debian packages, then .venv with this tree in editable mode.
# Usage: sh docker/install.sh [browser|system]    (as root, or as a user who may sudo; not needed once the Debian packages are there)
#        browser: with chromium, in which tests open pages, and cppcheck, which looks through the C
#        system:  the Debian packages only
set -eu

root=$(cd -- "$(dirname -- "$0")/.." && pwd -P)
venv=$root/.venv
python=/usr/bin/python3 # Debian's: the only one that finds Debian's dolfinx, whatever comes first on PATH

say() { printf '%s\n' "dolfbuoy: $*"; }
die() { printf '%s\n' "dolfbuoy: $*" >&2; exit 1; }

# ---- which system

system=$( (. /etc/os-release && echo "${ID:-unknown}-${VERSION_ID:-unreleased}") 2>/dev/null) || system=unknown
case $system in
    debian-12 | debian-13 | debian-unreleased) ;; # unreleased: sid and the next release, which have no number
    *)
        echo "dolfbuoy: this script supports Debian 12 (dolfinx 0.5.2), Debian 13 (dolfinx 0.9.0) and Debian sid (dolfinx 0.11) only, and this system is $system." >&2
        exit 2
        ;;
esac

# ---- Debian packages: everything that links MPI, PETSc or HDF5, and a compiler for the core and for FFCx's generated code

packages="python3-dolfinx python3-dolfinx-real python3-petsc4py python3-petsc4py-real
    python3-slepc4py python3-slepc4py-real python3-mpi4py openmpi-bin
    python3-netcdf4 python3-h5py python3-numpy python3-scipy python3-matplotlib python3-xarray python3-pandas
    python3-venv python3-dev python3-setuptools python3-cffi gcc g++ libc6-dev pkgconf ca-certificates"
case ${1:-} in
    "" | system) ;;
    browser) packages="$packages chromium cppcheck" ;;
    *) die "unknown: $1; there are browser and system" ;;
esac

apt() {
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=300 "$@"
}

apt_install() {
    # shellcheck disable=SC2086  # a list of words
    apt update && apt install --yes --no-install-recommends $missing
}

installed=$(dpkg-query -W -f '${Package} ${db:Status-Status}\n' 2>/dev/null | sed -n 's/ installed$//p')
missing=
for package in $packages; do
    printf '%s\n' "$installed" | grep -qxF -e "$package" || missing="$missing $package"
done

if [ -n "$missing" ]; then
    if [ "$(id -u)" -eq 0 ]; then
        as_root=
    elif command -v sudo >/dev/null; then
        as_root=sudo
    else
        die "only root can install the Debian packages that are missing:$missing"
    fi
    say "installing Debian packages:$missing"
    log=$(mktemp)
    trap 'rm -f "$log"' EXIT
    if ! apt_install >"$log" 2>&1; then
        say "apt-get failed, trying once more"
        sleep 10
        apt_install >"$log" 2>&1 || { tail -n 30 "$log" >&2; die "apt-get could not install the packages"; }
    fi
fi

[ "${1:-}" != system ] || exit 0

# Called through sudo in a tree that belongs to the caller: the rest needs no root and should not leave root's files.
if [ "$(id -u)" -eq 0 ] && [ "${SUDO_UID:-0}" -ne 0 ] && [ "$(stat -c %u -- "$root")" = "${SUDO_UID:-0}" ]; then
    exec sudo -H -u "#$SUDO_UID" sh "$root/docker/install.sh" "$@"
fi

# ---- virtual environment

unset PYTHONPATH PYTHONHOME VIRTUAL_ENV || true
export PYTHONNOUSERSITE=1 # what lies in ~/.local must not count as installed

# Intact: made here, by this Python, and runs. pyvenv.cfg records the command that made it.
intact() {
    grep -qxF -e "command = $python -m venv --system-site-packages $venv" "$venv/pyvenv.cfg" 2>/dev/null &&
        [ "$("$venv/bin/python" -c "$who" 2>/dev/null)" = "$venv $("$python" -c "$version")" ] &&
        "$venv/bin/python" -c 'import pip' 2>/dev/null
}
version='import sys; print(sys.version)'
who='import sys; print(sys.prefix, sys.version)'

if ! intact; then
    if [ -e "$venv" ]; then say "re-creating .venv"; else say "creating .venv"; fi
    rm -rf -- "$venv"
    "$python" -m venv --system-site-packages "$venv"
fi

# pip leaves these to Debian: what Debian has is held at its version, what pip cannot recognise as Debian's is refused.
constraints=$venv/constraints.txt
"$python" -I - >"$constraints" <<'EOF'
import importlib.metadata as metadata
import re

names = """numpy scipy matplotlib pandas xarray netCDF4 cftime h5py mpi4py petsc4py slepc4py
           fenics-dolfinx fenics-ffcx fenics-basix fenics-ufl""".split()
found = {}
for dist in metadata.distributions():
    if str(dist.locate_file("")).startswith("/usr/lib/"):
        found.setdefault(re.sub(r"[-_.]+", "-", dist.metadata["Name"] or "").lower(), dist.version)
for name in names:
    version = found.get(name.lower())
    print(f"{name}=={version}" if version else f"{name}<0")
EOF

stamp=$venv/installed.sha256
sum=$(cat "$root/pyproject.toml" "$root/docker/install.sh" "$constraints" | sha256sum)
if [ "$(cat "$stamp" 2>/dev/null)" != "$sum" ] || [ ! -x "$venv/bin/dolfbuoy" ]; then
    say "installing Python packages into .venv"
    rm -f -- "$stamp"
    pip_install() {
        (cd "$root" && "$venv/bin/python" -m pip --disable-pip-version-check install --quiet --no-input \
            --constraint "$constraints" --editable '.[test]')
    }
    if ! pip_install; then
        say "pip failed, trying once more"
        sleep 10
        pip_install || die "pip could not install the Python packages"
    fi
    echo "$sum" >"$stamp"
fi

# ---- what came of it

summary=$("$venv/bin/python" - <<'EOF'
import importlib
import importlib.metadata as metadata
import platform
import sys

import dolfinx
from petsc4py import PETSc

for name in "numpy scipy matplotlib pandas xarray netCDF4 h5py mpi4py petsc4py slepc4py ufl basix ffcx dolfinx".split():
    spec = importlib.util.find_spec(name)
    if spec is None or not spec.origin.startswith("/usr/lib/"):
        sys.exit(f"dolfbuoy: {name} must be Debian's, but comes from {spec and spec.origin}")
if PETSc.ScalarType().dtype.kind != "f":
    sys.exit("dolfbuoy: PETSc here is built for complex numbers; choose the real one: update-alternatives --config petsc")
petsc = ".".join(map(str, PETSc.Sys.getVersion()))
print(f"dolfbuoy {metadata.version('dolfbuoy')} in .venv: dolfinx {dolfinx.__version__}, PETSc {petsc} (real),",
      f"numpy {metadata.version('numpy')}, Python {platform.python_version()}")
EOF
) || die "the installation does not work"
say "ready: $summary"
