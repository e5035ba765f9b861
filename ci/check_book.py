"""Checks that every relative link in the Markdown files below the given paths leads to a file of the repository."""
import pathlib
import re
import sys

LINK = re.compile(r"\]\(([^)\s]+)\)")
broken = []
for root in map(pathlib.Path, sys.argv[1:]):
    files = root.rglob("*.md") if root.is_dir() else [root]
    for file in files:
        for target in LINK.findall(file.read_text(encoding="utf-8")):
            path = target.split("#")[0]
            if path and "://" not in path and not (file.parent / path).exists():
                broken.append(f"{file}: {target}")
print("\n".join(broken) or "every link leads somewhere")
sys.exit(bool(broken))
