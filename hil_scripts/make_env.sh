#!/usr/bin/env bash
# Build the virtual environment DIR from requirements.lock (hashes checked) and put this project into it, editable.
# Usage: make_env.sh DIR [PYTHON]
set -euo pipefail
dir=$1
wanted=${2:-}

new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

python=
for candidate in ${wanted:-python3.11 python3 python3.12 python3.13}; do
    if command -v "$candidate" >/dev/null && new_enough "$candidate"; then
        python=$candidate
        break
    fi
done
if [ -z "$python" ]; then
    echo "make env: needs Python 3.11 or newer; found: $(python3 --version 2>&1 || true). Set PYTHON=/path/to/python3.11" >&2
    exit 1
fi
if [ ! -x "$dir/bin/python" ]; then
    echo "make env: $("$python" --version) -> $dir"
    if ! "$python" -m venv "$dir"; then
        rm -rf "$dir"
        echo "make env: $python cannot make virtual environments (on Debian: apt install python3-venv)" >&2
        exit 1
    fi
fi
echo "make env: installing $(grep -c '^[a-z].*==' requirements.lock) packages from requirements.lock ..."
export PIP_DISABLE_PIP_VERSION_CHECK=1
# the lock is complete: nothing is to be resolved. Byte code is made by whatever is imported first: half of the time would go
# into modules nobody asks for
locked() { "$dir/bin/python" -m pip install --quiet --no-deps --no-compile --require-hashes -r "$1"; }
# uv fetches and unpacks on all cores, a tenth of pip's time; where there is no uv for the machine, or it cannot reach the index
# that pip is set up for, pip does the same
uv=$(mktemp)
trap 'rm -f "$uv"' EXIT
awk '/^[a-z]/ { mine = /^uv==/ } mine' requirements.lock > "$uv"
if locked "$uv" && "$dir/bin/uv" pip install --quiet --python "$dir/bin/python" --no-deps --require-hashes -r requirements.lock; then
    "$dir/bin/uv" pip install --quiet --python "$dir/bin/python" --no-deps --editable .
else
    echo "make env: uv did not do it; pip installs ..."
    locked requirements.lock
    "$dir/bin/python" -m pip install --quiet --no-deps --editable .
fi
echo "make env: done"
