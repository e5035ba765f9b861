#!/usr/bin/env python3
"""Order of the house: no circle of files, arrows between crates go down only, one way of module files, no file too long.

An edge goes from a file to the file where a name that it uses lives (`use crate::…`, `super::…`, `self::…` and paths written
in place). A module's own list of children (`mod`, `pub use` of what they hold) is no edge: that is how a folder is entered.
Names that a module re-exports are followed to the file that holds them. Code under `#[cfg(test)]` does not count.
Plain Python 3. Exit 1 with every finding on a line.
"""

import re
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# What each crate may import, besides `base`, which all may.
ARROWS = {
    "base": [],
    "data": [],
    "numerics": [],
    "geometry": [],
    "toolpath": ["geometry"],
    "planning": ["geometry", "toolpath"],
    "control": ["numerics"],
    "robot": ["geometry", "toolpath", "numerics"],
    "scan-head": ["geometry", "toolpath", "control", "numerics"],
    "gun": ["geometry", "toolpath", "numerics"],
    "deposition": ["geometry", "toolpath", "numerics", "data"],  # wires, gases and maps are called for by name
    "thermal": ["geometry", "toolpath", "numerics"],
    "melt-strategy": ["geometry", "thermal"],
    "perception": ["geometry", "numerics"],
    "programs": ["geometry", "toolpath"],
    "report": ["geometry"],
    "meltpath": ["*"],
    "cli": ["meltpath"],
}

# Longest file, in lines; and the files that are longer, each with its reason.
LONGEST = 600
LONG_FILES = {
    "crates/geometry/tests/all/mesh_io.rs": "both mesh formats share their helpers",
}


def code_of(text):
    """The text with comments, strings, characters and everything under `#[cfg(test)]` blanked; lines stay where they are."""
    out = list(text)
    blank = lambda a, b: out.__setitem__(slice(a, b), [c if c == "\n" else " " for c in text[a:b]])
    token = re.compile(
        r'//[^\n]*|/\*|(?<!\w)b?r(#*)"|"(?:\\.|[^"\\])*"|\'(?:\\(?:u\{[^}]*\}|x..|.)|[^\\\'\n])\'', re.S
    )
    at = 0
    while found := token.search(text, at):
        start, at = found.span()
        if found.group() == "/*":
            depth, at = 1, start + 2
            while depth and at < len(text):
                nested = re.compile(r"/\*|\*/").search(text, at)
                at = nested.end() if nested else len(text)
                depth += 1 if nested and nested.group() == "/*" else -1
        elif found.group(1) is not None:
            end = text.find('"' + found.group(1), at)
            at = len(text) if end < 0 else end + 1 + len(found.group(1))
        blank(start, at)
    code = "".join(out)
    for test in reversed(list(re.finditer(r"#\[cfg\((?:all\()?test\b[^\]]*\]", code))):
        end = block_end(code, test.end())
        code = code[: test.start()] + re.sub(r"[^\n]", " ", code[test.start() : end]) + code[end:]
    return code


def block_end(code, at):
    """The end of the item that starts at `at`: its closing brace, or its semicolon."""
    depth = 0
    while at < len(code):
        if code[at] in "{([":
            depth += 1
        elif code[at] in "})]":
            depth -= 1
            if depth == 0 and code[at] == "}":
                return at + 1
        elif code[at] == ";" and depth == 0:
            return at + 1
        at += 1
    return at


def split_outside(text, separator=","):
    """Parts of a list, braces respected."""
    parts, depth, last = [], 0, 0
    for i, c in enumerate(text):
        depth += (c in "{(<[") - (c in "})>]")
        if c == separator and depth == 0:
            parts.append(text[last:i])
            last = i + 1
    return [p.strip() for p in parts + [text[last:]] if p.strip()]


def expand(tree):
    """The single paths of a `use` tree, each as (segments, name it gets here)."""
    brace = tree.find("{")
    if brace >= 0:
        prefix = [s for s in tree[:brace].split("::") if s.strip()]
        for part in split_outside(tree[brace + 1 : tree.rindex("}")]):
            for segments, name in expand(part):
                if segments == ["self"]:
                    yield [s.strip() for s in prefix], name if name != "self" else prefix[-1].strip()
                else:
                    yield [s.strip() for s in prefix] + segments, name
        return
    path, _, alias = tree.partition(" as ")
    segments = [s.strip() for s in path.split("::") if s.strip()]
    yield segments, (alias.strip() or segments[-1])


class Module:
    """A module: its file, its children, what it uses, what it defines."""

    def __init__(self, path, file):
        self.path, self.file = path, file
        self.children, self.uses, self.inline, self.names = {}, [], [], set()


DEFINES = re.compile(
    r"\b(?:fn|struct|enum|union|trait|type|const|static|macro_rules!)\s+(?:mut\s+)?([A-Za-z_]\w*)"
)
USE = re.compile(r"((?:\bpub(?:\([^)]*\))?\s+)?)\buse\s+([^;]+);")
CHILD = re.compile(r"(?:#\[path\s*=\s*\"[^\"]*\"\]\s*)?\bmod\s+([A-Za-z_]\w*)\s*(;|\{)")
PATH = re.compile(r"(?<![\w:])((?:crate|super|self|[a-z_]\w*)(?:\s*::\s*[A-Za-z_]\w*)+)")


def read_module(path, file, code, folder, modules):
    module = modules[path] = Module(path, file)
    # inline modules are modules of their own in the same file
    at = 0
    while found := CHILD.search(code, at):
        name = found.group(1)
        if found.group(2) == "{":
            end = block_end(code, found.start())
            inner = code[found.end() : end - 1]
            read_module(path + (name,), file, inner, folder / name, modules)
            code = code[: found.start()] + re.sub(r"[^\n]", " ", code[found.start() : end]) + code[end:]
            at = found.start()
        else:
            for place in (folder / f"{name}.rs", folder / name / "mod.rs"):
                if place.is_file():
                    read_module(path + (name,), place, code_of(place.read_text()), folder / name, modules)
            at = found.end()
        module.children[name] = path + (name,)
    for found in USE.finditer(code):
        for segments, name in expand(" ".join(found.group(2).split())):
            module.uses.append((segments, name, bool(found.group(1))))
    rest = USE.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), code)
    module.inline = [[s.strip() for s in p.split("::")] for p in PATH.findall(rest)]
    module.names = set(DEFINES.findall(rest))


def resolve(modules, module, segments, seen=()):
    """The module that holds what a path names, with that name; None when it leaves the crate."""
    first = segments[0]
    if first == "crate":
        here, rest = (), segments[1:]
    elif first in ("self", "super"):
        here, rest = module.path, segments[1:]
        if first == "super":
            here = here[:-1]
        while rest and rest[0] == "super":
            here, rest = here[:-1], rest[1:]
    elif first in module.children:
        here, rest = module.path, segments
    else:
        return None
    while rest and here in modules and rest[0] in modules[here].children:
        here, rest = modules[here].children[rest[0]], rest[1:]
    target = modules.get(here)
    if target is None:
        return None
    if rest and rest[0] not in target.names:
        # re-exported: go to where it is held
        for path, name, _ in target.uses:
            if name == rest[0] and (here, name) not in seen:
                found = resolve(modules, target, path, (*seen, (here, name)))
                if found:
                    return found
        for path, name, _ in target.uses:
            if name == "*" and (here, "*", rest[0]) not in seen:
                found = resolve(modules, target, [*path[:-1], rest[0]], (*seen, (here, "*", rest[0])))
                if found and rest[0] in found[0].names:
                    return found
    return target, (rest[0] if rest else "self")


def edges_of(modules):
    """From file to file, with the names that make the edge."""
    edges = {}
    for module in modules.values():
        aliases = {name: path for path, name, _ in module.uses}
        paths = [(path, public) for path, _, public in module.uses]
        for path in module.inline:
            if path[0] in aliases and path[0] not in module.children:
                path = aliases[path[0]] + path[1:]
            paths.append((path, False))
        for path, public in paths:
            found = resolve(modules, module, path)
            if not found:
                continue
            target, name = found
            if target.file == module.file:
                continue
            below = target.path[: len(module.path)] == module.path
            if public and below:
                continue  # a parent's re-export
            edges.setdefault(module.file, {}).setdefault(target.file, set()).add(name)
    return edges


def circles(edges):
    """Strongly connected components of more than one file (Tarjan, without recursion)."""
    index, low, stack, on, found, count = {}, {}, [], set(), [], 0
    for root in sorted(set(edges) | {t for e in edges.values() for t in e}):
        if root in index:
            continue
        work = [(root, iter(sorted(edges.get(root, ()))))]
        index[root] = low[root] = count
        count += 1
        stack.append(root)
        on.add(root)
        while work:
            node, rest = work[-1]
            step = next(rest, None)
            if step is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    group = []
                    while True:
                        member = stack.pop()
                        on.discard(member)
                        group.append(member)
                        if member == node:
                            break
                    if len(group) > 1:
                        found.append(sorted(group))
            elif step not in index:
                index[step] = low[step] = count
                count += 1
                stack.append(step)
                on.add(step)
                work.append((step, iter(sorted(edges.get(step, ())))))
            elif step in on:
                low[node] = min(low[node], index[step])
    return sorted(found)


def crate_modules(crate):
    src = crate / "src"
    modules = {}
    for entry in (src / "lib.rs", src / "main.rs"):
        if entry.is_file():
            read_module((), entry, code_of(entry.read_text()), src, modules)
    return modules


def room_of(package):
    return "meltpath" if package == "meltpath" else package.removeprefix("meltpath-")


def forbidden_arrows(crate):
    """Dependencies of the crate (not of its tests) that the table does not allow, and arrows of the table that it does not use."""
    text = (crate / "Cargo.toml").read_text()
    allowed = ARROWS.get(crate.name)
    if allowed is None:
        return [f"{crate.name}: not in the table of arrows (ci/check_circles.py)"]
    table = re.search(r"^\[dependencies\]\n(.*?)(?=^\[|\Z)", text, re.S | re.M)
    rooms = re.findall(r"^(meltpath(?:-[a-z-]+)?)\b", table.group(1) if table else "", re.M)
    bad = [r for r in map(room_of, rooms) if r != "base" and r not in allowed and "*" not in allowed]
    if crate.name == "base" and rooms:
        bad = [room_of(r) for r in rooms]
    unused = set(allowed) - set(map(room_of, rooms)) - {"*"}
    return [f"{crate.name} imports {r}: arrows go down only" for r in bad] + [
        f"{crate.name} does not import {r}: take it off the table of arrows" for r in sorted(unused)
    ]


def self_check():
    """The script finds the circle of a small crate that has one, and none where a parent only re-exports."""
    sample = {
        "lib.rs": "mod one;\nmod two;\nmod three;\npub use one::{inner::Deep, One};\n",
        "one.rs": "pub mod inner;\nuse crate::two::{self, Two as Other};\npub struct One(Other);\n",
        "one/inner.rs": "use super::One;\npub struct Deep(One);\n",
        "two.rs": "pub struct Two;\npub fn make() -> crate::One { todo!() }\n",
        "three.rs": "// use crate::one::One; super::three\n#[cfg(test)]\nmod tests { use crate::two::Two; }\npub const A: &str = \"crate::one::One\";\n",
    }
    with tempfile.TemporaryDirectory() as place:
        for name, text in sample.items():
            file = Path(place) / "src" / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        found = circles(edges_of(crate_modules(Path(place))))
        names = [[f.name for f in group] for group in found]
        if names != [["one.rs", "two.rs"]]:
            sys.exit(f"check_circles.py does not work any more: it finds {names} in its own sample")


def main():
    self_check()
    findings, number = [], 0
    for crate in sorted((ROOT / "crates").iterdir()):
        if not (crate / "Cargo.toml").is_file():
            continue
        findings += forbidden_arrows(crate)
        edges = edges_of(crate_modules(crate))
        for group in circles(edges):
            number += 1
            short = lambda f: str(f.relative_to(crate / "src"))
            lines = [f"circle of {len(group)} files in {crate.name}:"]
            for file in group:
                for target in sorted(set(edges.get(file, {})) & set(group)):
                    names = ", ".join(sorted(edges[file][target]))
                    lines.append(f"    {short(file)} -> {short(target)}: {names}")
            findings.append("\n".join(lines))
    for file in sorted((ROOT / "crates").rglob("*.rs")):
        place = file.relative_to(ROOT)
        if "target" in place.parts:
            continue
        if file.name == "mod.rs" and "src" in place.parts:
            findings.append(f"{place}: a module's file stands beside its folder (name.rs), not in it")
        lines = file.read_text().count("\n")
        if lines > LONGEST and str(place) not in LONG_FILES:
            findings.append(f"{place}: {lines} lines, more than {LONGEST}: two subjects?")
        if lines <= LONGEST and str(place) in LONG_FILES:
            findings.append(f"{place}: {lines} lines: take it off the list of long files")
    for line in findings:
        print(line)
    print(f"{number} circles of files, {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
