"""Checks that every file of this repository, and every file that runs have written, can exist on Windows and beside its kin.

Usage: check_names.py [FOLDER…]   with folders of results
"""
import pathlib
import re
import subprocess
import sys

# https://learn.microsoft.com/windows/win32/fileio/naming-a-file
FORBIDDEN = re.compile(r'[<>:"\\\\|?*\x00-\x1f]|[ .]$')
RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)", re.IGNORECASE)
LONGEST = 200


def faults(paths):
    seen = {}
    for path in paths:
        for part in pathlib.PurePosixPath(path).parts:
            if FORBIDDEN.search(part) or RESERVED.match(part):
                yield f"{path}: Windows has no file named {part!r}"
        if len(path) > LONGEST:
            yield f"{path}: longer than {LONGEST} characters"
        other = seen.setdefault(path.lower(), path)
        if other != path:
            yield f"{path} and {other} are one file on Windows"


tracked = subprocess.run(["git", "ls-files", "-z"], check=True, capture_output=True, text=True).stdout.split("\0")
found = list(faults(filter(None, tracked)))
for folder in map(pathlib.Path, sys.argv[1:]):
    found += faults(sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()))
print("\n".join(found) or "every name can be used on Windows")
sys.exit(bool(found))
