"""Writes the book's table of acceptance cases from acceptance.toml.

    python3 ci/acceptance_table.py                 writes docs/theory/acceptance.md
    python3 ci/acceptance_table.py --check         fails where the page is not up to date
    python3 ci/acceptance_table.py --tests FILE    fails where rows and tests disagree; FILE: `cargo test --workspace -- --list`

The rows themselves are looked at every time: every case of the sources has one, and each says what its state needs.
"""
import pathlib
import re
import sys
import tomllib

PAGE = pathlib.Path("docs/theory/acceptance.md")
STATES = ("reproduced", "recorded", "open")
ENTRIES = ("job", "command", "library", "room")
KEYS = {"id", "what", "source", "ours", "state", "reason", "tests", "enters", "why_room"}
# the cases of the sources, and how the name of a test bears them
CASES = (
    [f"waam AC-{n}" for n in range(1, 50)]
    + [f"multi-axis MA-{n}" for n in range(1, 10)]
    + [f"ebm {letter}{n}" for letter, last in zip("AGTBQ", (14, 11, 12, 7, 14)) for n in range(1, last + 1)]
    + [f"lpbf AC-{n:02}" for n in range(1, 51)]
    + ["lpbf AC-48b"]
)
BEARS = {
    "waam_": (r"_ac(\d+)", lambda m: f"waam AC-{int(m[1])}"),
    "multiaxis_": (r"_ma(\d+)", lambda m: f"multi-axis MA-{int(m[1])}"),
    "ebm_": (r"_([agtbq])(\d+)(?=_)", lambda m: f"ebm {m[1].upper()}{int(m[2])}"),
    "lpbf_": (r"_ac(\d+)(b?)(?=_)", lambda m: f"lpbf AC-{int(m[1]):02}{m[2]}"),
}


def of_case(row, case):
    return row["id"] == case or row["id"].startswith(case + ",")


def faults_of_rows(rows):
    """What a row lacks or says twice."""
    ids = [row.get("id", "") for row in rows]
    for case in CASES:
        if not any(of_case({"id": i}, case) for i in ids):
            yield f"{case}: no row"
    for row in rows:
        name = row.get("id") or "a row without id"
        if ids.count(row.get("id", "")) > 1:
            yield f"{name}: more than one row"
        for key in row.keys() - KEYS:
            yield f"{name}: unknown key {key}"
        if not row.get("what") or not row.get("source"):
            yield f"{name}: `what` and `source` are needed"
        state, tests = row.get("state"), row.get("tests", [])
        if state not in STATES:
            yield f"{name}: state {state!r} is none of {', '.join(STATES)}"
        if state in ("recorded", "open") and not row.get("reason"):
            yield f"{name}: {state} needs a reason"
        if state in ("reproduced", "recorded") and not tests:
            yield f"{name}: {state} needs tests"
        if tests and row.get("enters") not in ENTRIES:
            yield f"{name}: enters {row.get('enters')!r} is none of {', '.join(ENTRIES)}"
        if row.get("enters") == "room" and not row.get("why_room"):
            yield f"{name}: tests enter at a room: why_room says why not higher"


def names_listed(text):
    """Full names of tests, as cargo lists them: `path::name: test`, doc tests as `file - path::name (line 9): test`."""
    for line in text.splitlines():
        if line.endswith(": test"):
            yield re.sub(r" \(line \d+\)$", "", line.removesuffix(": test")).split(" - ")[-1]


def faults_of_tests(rows, listed):
    """Where rows and tests disagree."""
    for row in rows:
        for test in row.get("tests", []):
            found = [full for full in listed if full == test or full.endswith("::" + test)]
            if not found:
                yield f"{row['id']}: no test is named {test}"
            elif len(found) > 1:
                yield f"{row['id']}: {test} is more than one test: {', '.join(sorted(found))}"
    for full in sorted(listed):
        name = full.split("::")[-1]
        prefix = next((p for p in BEARS if name.startswith(p)), None)
        if prefix is None:
            continue
        naming = [row for row in rows if any(full == t or full.endswith("::" + t) for t in row.get("tests", []))]
        if not naming:
            yield f"{full}: its name bears a case, but no row names it"
        pattern, case_of = BEARS[prefix]
        for case in map(case_of, re.finditer(pattern, name)):
            if naming and not any(of_case(row, case) for row in naming):
                yield f"{full}: no row of {case} names it"


def table(rows):
    count = {state: sum(row["state"] == state for row in rows) for state in STATES}
    parts = (("Wire arc", "waam "), ("Multi-axis wire", "multi-axis "), ("Electron beam", "ebm "), ("Laser scan head", "lpbf "))
    lines = [
        "# Acceptance cases",
        "",
        "> **In short.** Four sources print figures that a simulation can be held against. One row a case tells whether ours are theirs, and where",
        "> not, why. Read the rows of your process before you trust a figure: what is open, nothing holds.",
        ">",
        "> | | reproduced | recorded | open |",
        "> |---|---|---|---|",
    ]
    for title, prefix in parts:
        of = [row["state"] for row in rows if row["id"].startswith(prefix)]
        link = f"[{title}](#{title.lower().replace(' ', '-')})"
        lines.append(f"> | {link} | " + " | ".join(str(of.count(state)) for state in STATES) + " |")
    lines += [
        f"> | all | {count['reproduced']} | {count['recorded']} | {count['open']} |",
        "",
        "| state | what it says |",
        "|---|---|",
        "| reproduced | tests assert the source's value within its tolerance |",
        "| recorded | tests assert our value, which differs, or a case of our own; the reason stands beside it |",
        "| open | nothing asserts the case |",
        "",
        "Sources: Rouchon 2022 (wire arc), Campocasso 2017 (multi-axis), Béraud 2016 (electron beam), Rasoanarivo 2020 (laser).",
        "[Sources and readings](sources.md) tells their errata (E1 to E29), the reference heads and the independent solver.",
        "",
        "*Enters* is where the tests come in: a job file, a command, a call of the library, or one room below it.",
        "The page is made from `acceptance.toml`, where each row names its tests, by `python3 ci/acceptance_table.py`.",
    ]
    for title, prefix in parts:
        lines += ["", f"## {title}", "", "| case | what | source | state | ours, and why | enters |", "|---|---|---|---|---|---|"]
        for row in rows:
            if row["id"].startswith(prefix):
                ours = "; ".join(filter(None, (row.get("ours"), row.get("reason"))))
                cells = [row["id"].removeprefix(prefix), row["what"], row["source"], row["state"], ours, row.get("enters", "")]
                lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def main(arguments):
    rows = tomllib.loads(pathlib.Path("acceptance.toml").read_text(encoding="utf-8"))["case"]
    faults = list(faults_of_rows(rows))
    if arguments[:1] == ["--tests"]:
        listed = set(names_listed(pathlib.Path(arguments[1]).read_text(encoding="utf-8")))
        if len(listed) < len(rows):
            faults.append(f"{arguments[1]} lists {len(listed)} tests only: is it what `cargo test --workspace -- --list` prints?")
        faults += faults_of_tests(rows, listed)
    elif arguments == ["--check"]:
        if not faults and PAGE.read_text(encoding="utf-8") != table(rows):
            faults.append(f"{PAGE} is not made from acceptance.toml: run python3 ci/acceptance_table.py")
    elif arguments:
        sys.exit(__doc__)
    elif not faults:
        PAGE.write_text(table(rows), encoding="utf-8")
    if faults:
        sys.exit("\n".join(faults))
    print(f"{len(rows)} rows for {len(CASES)} cases")


main(sys.argv[1:])
