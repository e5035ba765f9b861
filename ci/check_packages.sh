#!/usr/bin/env bash
# Packs every crate and checks what lies in the archives, all of them together and apart from the repository: a file that an
# archive lacks fails here, not on crates.io. Tests are built too: a crate whose tests need what lies outside leaves them out.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
place="$target/packages"
rm -rf "$target/package" "$place"
mkdir -p "$place"
cargo package --workspace --exclude meltpath-fuzz-bodies --no-verify --allow-dirty --quiet
for archive in "$target"/package/*.crate; do tar -xmzf "$archive" -C "$place"; done  # files as new as they are here: cargo goes by their times
python3 - Cargo.toml "$place" <<'PY'
import pathlib, re, sys, tomllib

root, place = pathlib.Path(sys.argv[1]).read_text(), pathlib.Path(sys.argv[2])
patches, missing = [], []
for manifest in sorted(place.glob("*/Cargo.toml")):
    package = tomllib.loads(manifest.read_text())["package"]
    patches.append(f'{package["name"]} = {{ path = "{manifest.parent.name}" }}')
    missing += [f'{package["name"]}: no {key}' for key in ("description", "license", "readme", "keywords", "categories", "repository") if not package.get(key)]
if missing:
    sys.exit("\n".join(missing))
# the same profiles, so that what was checked of other libraries serves again
root = re.sub(r"^members = .*$", 'members = ["*"]', root, flags=re.M)
root = re.sub(r"^exclude = .*\n", "", root, flags=re.M)
(place / "Cargo.toml").write_text(root + "\n[patch.crates-io]\n" + "\n".join(patches) + "\n")
print(len(patches), "packages")
PY
cp Cargo.lock "$place/"
cargo check --release --manifest-path "$place/Cargo.toml" --target-dir "$target" --workspace --lib --bins --tests --quiet
