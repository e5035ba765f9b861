"""Runs every step of examples/ as a user would and compares verdict and key figures with examples/expected/NAME.toml.

    python3 ci/run_examples.py OUT              runs all into the new folder OUT, two at a time, and compares
    python3 ci/run_examples.py OUT --record     the same, then writes what was found; look at the difference before committing it
    python3 ci/run_examples.py OUT --no-run     compares (or records) what OUT already holds
    options: --only NAME,NAME    --binary PATH (target/release/meltpath)

Of a step stand there its `command` ({out} is its own folder, {NAME} that of another step, which runs before) and, where it needs a file that does not
ship, the script that will `make` it. Expected are the exit code, each check with its outcome, each value with its uncertainty, the codes of warnings,
the figures in what is printed, and of each table, program and JSON file written how many rows or numbers it has and the sums of their magnitudes.
Tolerances with their reasons: examples/expected/tolerances.toml.
"""
import argparse
import concurrent.futures
import csv
import fnmatch
import json
import math
import pathlib
import re
import shlex
import subprocess
import sys
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXPECTED = ROOT / "examples" / "expected"
# minutes each: started last they would run alone
LONGEST = ("branch", "ebm-triangle", "ebm-struts", "ebm-bridge", "torus-on-positioner", "node")
# at a time: most use one core for much of their time, and none more than 2 GB
RUNS = 2
TABLES = ("program/*", "series/*.csv", "*.csv", "controllers.json", "test.json")
# names of the files of examples/ that a command starts from
STARTED = ("job", "tune", "measurements", "map")
BARE = re.compile(r"[A-Za-z0-9_-]+")
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def leaves(tree, key=""):
    """Each value of a JSON tree with the key that it stands under."""
    if isinstance(tree, (dict, list)):
        for name, value in tree.items() if isinstance(tree, dict) else ((key, value) for value in tree):
            yield from leaves(value, name)
    else:
        yield key, tree


def numbers_of(path):
    """What a file holds: of a table its rows and the sum of magnitudes of each column, of JSON that of each key, of other text its numbers and theirs."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if path.suffix == ".csv":
        rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
        count, cells = {"rows": len(rows)}, (cell for row in rows for cell in row.items())
    elif path.suffix == ".json":
        count, cells = {}, leaves(json.loads(text))
    else:
        # 9E+09 is how a RAPID program says that an axis is not there: its sum would hide the others
        cells = [("sum", number) for number in NUMBER.findall(text) if abs(float(number)) < 1e9]
        count = {"numbers": len(cells)}
    sums = {}
    for name, cell in cells:
        try:
            value = abs(float(cell))
        except (TypeError, ValueError):
            continue
        if math.isfinite(value) and not isinstance(cell, bool):
            sums.setdefault(name, []).append(value)
    return count | {name: math.fsum(values) for name, values in sums.items()}


def found_in(answer):
    """What a step says: a nested dictionary with the layout of an expected file."""
    found = {"exit": answer["exit_code"], "warnings": [], "checks": {}, "facts": {}, "printed": {}, "files": {}}
    run = pathlib.Path(answer.get("folder", "nowhere"))
    for line in answer.get("lines", []):
        figures = NUMBER.findall(line)
        if figures and str(run) not in line:
            told = found["printed"].setdefault(NUMBER.sub("#", line), {})
            told |= {str(k): float(n) for k, n in enumerate(figures, len(told) + 1)}
    if not (run / "verdict.json").exists():
        return found
    verdict = json.loads((run / "verdict.json").read_text(encoding="utf-8"))
    found["warnings"] = sorted({w["code"] for w in verdict["warnings"]})
    for entry in verdict["checks"] + verdict.get("facts", []):
        value = entry.get("value")
        figure = {k: value[k] for k in ("value", "sigma", "unit") if value and value.get(k) is not None}
        # what has a value and nothing to hold it against is a fact
        if entry.get("limit") is None and (value or "status" not in entry):
            found["facts"][entry["id"]] = figure
        else:
            found["checks"][entry["id"]] = {"status": entry["status"], **figure}
    for pattern in TABLES:
        for path in sorted(run.glob(pattern)):
            found["files"][path.relative_to(run).as_posix()] = numbers_of(path)
    return found


def tolerance(groups, name, recorded):
    group = next(g for g in groups if any(fnmatch.fnmatch(name, n) for n in g["names"]))
    return group["relative"] * abs(recorded) + group.get("absolute", 0.0)


def differences(expected, found, groups):
    """Lines that say what differs, for a person."""
    for key, words in (("exit", "exit code"), ("warnings", "warnings")):
        if expected[key] != found[key]:
            yield f"{words}: {found[key]}, recorded {expected[key]}"
    for section in ("checks", "facts", "printed", "files"):
        before, now = expected.get(section, {}), found[section]
        for name in [*before, *(n for n in now if n not in before)]:
            if name not in now:
                yield f"{section}: {name} is gone"
            elif name not in before:
                yield f"{section}: {name} is new: {now[name]}"
            else:
                for key in sorted(before[name].keys() | now[name].keys()):
                    old, new = before[name].get(key), now[name].get(key)
                    if isinstance(old, (int, float)) and isinstance(new, (int, float)):
                        near = tolerance(groups, name, old if key != "sigma" else max(abs(old), abs(before[name].get("value", old))))
                        if not abs(new - old) <= (0 if key in ("rows", "numbers") else near):
                            yield f"{section}: {name} {key} {new!r}, recorded {old!r} (off by {new - old:.3g}, tolerance {near:.3g})"
                    elif old != new:
                        yield f"{section}: {name} {key} {new!r}, recorded {old!r}"


def write(path, expected):
    def inline(value):
        if isinstance(value, dict):
            return "{ " + ", ".join(f"{k if BARE.fullmatch(k) else json.dumps(k, ensure_ascii=False)} = {inline(v)}" for k, v in value.items()) + " }"
        if isinstance(value, float):
            return repr(float(f"{value:.10g}"))
        return json.dumps(value, ensure_ascii=False)

    lines = ["# Written by ci/run_examples.py --record.", *(f"{k} = {inline(expected[k])}" for k in ("make", "command", "exit", "warnings") if k in expected)]
    for section in ("checks", "facts", "printed", "files"):
        if expected[section]:
            lines += ["", f"[{section}]", *(f"{json.dumps(name, ensure_ascii=False)} = {inline(v)}" for name, v in expected[section].items())]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def run_step(binary, expected, folder):
    """Leaves what the step prints in `folder`.json, and what it tells beside that in `folder`.log."""
    places = {"out": folder, **{name: folder.with_name(name) for name in expected["after"]}}
    with open(folder.with_suffix(".log"), "wb") as log, open(folder.with_suffix(".json"), "wb") as said:
        for key, program, out in (("make", [sys.executable], log), ("command", [binary, "--json"], said)):
            words = [word.format_map(places) for word in shlex.split(expected.get(key, ""))]
            if words:
                subprocess.run(program + words, cwd=ROOT / "examples", stdout=out, stderr=log)


def steps():
    """The expected files by name, each with the steps that it comes `after`; those that come after others last."""
    told = {}
    for path in sorted(EXPECTED.glob("*.toml")):
        if path.stem != "tolerances":
            step = {"exit": 0, "warnings": []} | tomllib.loads(path.read_text(encoding="utf-8"))
            told[path.stem] = step | {"after": [n for n in re.findall(r"{([^}]+)}", step["command"]) if n != "out"]}
    return dict(sorted(told.items(), key=lambda s: (bool(s[1]["after"]), s[0] not in LONGEST)))


def compare(arguments, name, expected, groups, others):
    """Runs one step; whether it differs from what is recorded, and the lines that say so."""
    concurrent.futures.wait(others[n] for n in expected["after"] if n in others)
    folder, begun = arguments.out.resolve() / name, time.monotonic()
    if not arguments.no_run:
        run_step(arguments.binary.resolve(), expected, folder)
    said = folder.with_suffix(".json").read_text(encoding="utf-8")
    answer = json.loads(said or '{"exit_code": -1}')
    for other in expected["after"]:
        place = re.compile(re.escape(folder.with_name(other).as_posix()) + r"(?![\w-])")
        answer["lines"] = [place.sub(f"{{{other}}}", line) for line in answer.get("lines", [])]
    found = expected | found_in(answer)
    code = found["exit"]
    said = list(differences(expected, found, groups))
    took = f"{time.monotonic() - begun:.0f} s"
    lines = [f"{name:24} exit {code}, {len(found['checks'])} checks, {took}: {'as recorded' if not said else 'DIFFERS'}"]
    lines += [f"    {line}" for line in said]
    if said and code not in (0, expected["exit"]):
        lines.append(folder.with_suffix(".log").read_text(encoding="utf-8", errors="replace")[-2000:])
    if arguments.record:
        write(EXPECTED / f"{name}.toml", found)
    return bool(said), lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--no-run", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--binary", default=ROOT / "target" / "release" / "meltpath", type=pathlib.Path)
    arguments = parser.parse_args()
    groups = tomllib.loads((EXPECTED / "tolerances.toml").read_text(encoding="utf-8"))["group"]
    wrong = False
    told = steps()
    files = {p.relative_to(ROOT / "examples").as_posix() for kind in STARTED for p in ROOT.glob(f"examples/*/{kind}.toml")}
    for file in sorted(files ^ {word for step in told.values() for word in shlex.split(step["command"]) if word.endswith(".toml")}):
        wrong = True
        print(f"{file}: in examples/ or in examples/expected/, not in both")
    arguments.out.mkdir(parents=True, exist_ok=arguments.no_run)
    chosen = [name for name in told if not arguments.only or name in arguments.only.split(",")]
    runs = {}
    with concurrent.futures.ThreadPoolExecutor(RUNS) as pool:
        for name in chosen:
            runs[name] = pool.submit(compare, arguments, name, told[name], groups, runs)
        for run in concurrent.futures.as_completed(runs.values()):
            differs, lines = run.result()
            print(*lines, sep="\n", flush=True)
            wrong |= differs and not arguments.record
    sys.exit(wrong)


main()
