"""Checks that every relative link in the Markdown files below the given paths leads to a file of the repository and to a heading in it,
that files and packages named in them are there, and that the book's SUMMARY.md lists every page."""
import pathlib
import re
import sys

LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
FILE = re.compile(r"`((?:crates|examples|ci|docs|bench|[a-z-]+/src)/[\w./-]*)`")
PACKAGE = re.compile(r"cargo \w+ [^`\n]*?-p ([\w-]+)")
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def anchors(text):
    """The names of headings, as GitHub and mdBook make them."""
    titles = HEADING.findall(FENCE.sub("", text))
    return {re.sub(r"[^\w\- ]", "", LINK.sub("]", t).lower()).strip().replace(" ", "-") for t in titles}


def main(roots):
    broken = []
    packages = {
        re.search(r'^name = "(.+)"', m.read_text(encoding="utf-8"), re.MULTILINE)[1] for m in pathlib.Path("crates").glob("*/Cargo.toml")
    }
    for root in map(pathlib.Path, roots):
        files = list(root.rglob("*.md")) if root.is_dir() else [root]
        for file in files:
            text = file.read_text(encoding="utf-8")
            broken += [f"{file}: {p} is no package" for p in PACKAGE.findall(text) if p not in packages]
            for name in FILE.findall(text):
                made_by_a_run = "-runs/" in name
                if not (made_by_a_run or pathlib.Path(name).exists() or pathlib.Path("crates", name).exists()):
                    broken.append(f"{file}: {name} is not there")
            for target in LINK.findall(text):
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
