"""Checks that every relative link in the Markdown files below the given paths leads to a file of the repository and to a heading in it,
and that the book's SUMMARY.md lists every page."""
import pathlib
import re
import sys

LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def anchors(text):
    """The names of headings, as GitHub and mdBook make them."""
    titles = HEADING.findall(FENCE.sub("", text))
    return {re.sub(r"[^\w\- ]", "", LINK.sub("]", t).lower()).strip().replace(" ", "-") for t in titles}


def main(roots):
    broken = []
    for root in map(pathlib.Path, roots):
        files = list(root.rglob("*.md")) if root.is_dir() else [root]
        for file in files:
            for target in LINK.findall(file.read_text(encoding="utf-8")):
                path, _, anchor = target.partition("#")
                if "://" in target:
                    continue
                there = file.parent / path if path else file
                if not there.exists():
                    broken.append(f"{file}: {target} leads nowhere")
                elif anchor and there.suffix == ".md" and anchor not in anchors(there.read_text(encoding="utf-8")):
                    broken.append(f"{file}: {target} names no heading")
        summary = root / "SUMMARY.md"
        if summary.exists():
            listed = {(root / t).resolve() for t in LINK.findall(summary.read_text(encoding="utf-8"))}
            broken += [f"{file}: not in {summary}" for file in files if file != summary and file.resolve() not in listed]
    print("\n".join(broken) or "every link leads somewhere, and every page is listed")
    return bool(broken)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
