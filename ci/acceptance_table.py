"""Writes the book's table of acceptance cases from acceptance.toml; with --check, fails where the page is not up to date."""
import pathlib
import sys
import tomllib

cases = tomllib.loads(pathlib.Path("acceptance.toml").read_text(encoding="utf-8"))["case"]
lines = [
    "# Acceptance cases",
    "",
    "Made from `acceptance.toml` by `ci/acceptance_table.py`. Each reproduced or recorded case is a test that bears its id",
    "(`waam_ac21_…`, `waam_wall_thin_…`). Recorded: the test asserts our value, which differs from the source; the reason stands beside it.",
    "",
    "| case | what | state | ours | reason |",
    "|---|---|---|---|---|",
]
lines += [f"| {c['id']} | {c['what']} | {c['state']} | {c.get('ours', '')} | {c.get('reason', '')} |" for c in cases]
page = pathlib.Path("docs/theory/acceptance.md")
text = "\n".join(lines) + "\n"
if "--check" in sys.argv:
    if page.read_text(encoding="utf-8") != text:
        sys.exit("docs/theory/acceptance.md is not made from acceptance.toml: run python3 ci/acceptance_table.py")
    print(f"{len(cases)} acceptance cases told")
else:
    page.write_text(text, encoding="utf-8")
