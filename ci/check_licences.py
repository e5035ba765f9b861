"""Checks that every crate of the default build has a licence that may be shipped with meltpath."""
import json
import re
import subprocess
import sys

ALLOWED = {
    "MIT", "MIT-0", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "0BSD", "ISC", "Zlib", "Unicode-3.0", "CC0-1.0",
    "Unlicense", "CDLA-Permissive-2.0",
}
metadata = json.loads(subprocess.run(["cargo", "metadata", "--format-version", "1"], check=True, capture_output=True, text=True).stdout)


def acceptable(expression):
    # an OR needs one acceptable side, an AND needs both
    expression = expression.replace("/", " OR ").replace("Apache-2.0 WITH LLVM-exception", "Apache-2.0")
    alternatives = re.split(r"\bOR\b", re.sub(r"[()]", " ", expression))
    return any(all(term.strip() in ALLOWED for term in re.split(r"\bAND\b", alternative)) for alternative in alternatives)


refused = [f"{p['name']} {p['version']}: {p['license']}" for p in metadata["packages"] if not acceptable(p["license"] or "")]
print("\n".join(refused) or f"{len(metadata['packages'])} packages, every licence may be shipped")
sys.exit(bool(refused))
