"""Runs every job of examples/ as a user would and compares verdict and key figures with examples/expected/NAME.toml.

    python3 ci/run_examples.py OUT              runs all into the new folder OUT, two at a time, and compares
    python3 ci/run_examples.py OUT --record     the same, then writes what was found; look at the difference before committing it
    python3 ci/run_examples.py OUT --no-run     compares (or records) what OUT already holds
    options: --only NAME,NAME    --binary PATH (target/release/meltpath)

Expected are the exit code, each check with its outcome, each value with its uncertainty, the codes of warnings, and of each table and
program that a run writes how many rows or numbers it has and the sums of their magnitudes. Tolerances with their reasons: examples/expected/tolerances.toml.
"""
import argparse
import concurrent.futures
import csv
import fnmatch
import json
import math
import pathlib
import re
import subprocess
import sys
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXPECTED = ROOT / "examples" / "expected"
# minutes each: started last they would run alone
LONGEST = ("ebm-triangle", "ebm-bridge", "torus-on-positioner")
# at a time: most use one core for much of their time, and none more than 2 GB
RUNS = 2
TABLES = ("program/*", "series/*.csv", "*.csv", "controllers.json")
BARE = re.compile(r"[A-Za-z0-9_-]+")
NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def numbers_of(path):
    """What a file holds: of a table its rows and the sum of magnitudes of each column, of other text its numbers and theirs."""
    if path.suffix != ".csv":
        values = [abs(float(n)) for n in NUMBER.findall(path.read_bytes())]
        return {"numbers": len(values), "sum": math.fsum(values)}
    rows = csv.DictReader(line for line in path.open(encoding="utf-8") if not line.startswith("#"))
    sums, count = {}, 0
    for count, row in enumerate(rows, 1):
        for column, cell in row.items():
            try:
                value = abs(float(cell))
            except (TypeError, ValueError):
                continue
            if math.isfinite(value):
                sums.setdefault(column, []).append(value)
    return {"rows": count, **{column: math.fsum(values) for column, values in sums.items()}}


def found_in(run, code):
    """What a run says: a nested dictionary with the layout of an expected file."""
    found = {"exit": code, "warnings": [], "checks": {}, "facts": {}, "files": {}}
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
    for section in ("checks", "facts", "files"):
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
                        near = tolerance(groups, name, old if key != "sigma" else max(abs(old), abs(before[name]["value"])))
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

    lines = ["# Written by ci/run_examples.py --record.", *(f"{k} = {inline(expected[k])}" for k in ("job", "command", "exit", "warnings"))]
    for section in ("checks", "facts", "files"):
        if expected[section]:
            lines += ["", f"[{section}]", *(f"{json.dumps(name, ensure_ascii=False)} = {inline(v)}" for name, v in expected[section].items())]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def run_job(binary, expected, folder):
    with open(folder.with_suffix(".log"), "wb") as log:
        job = ROOT / "examples" / expected["job"]
        return subprocess.run([binary, expected["command"], job, "--out", folder], stdout=log, stderr=subprocess.STDOUT).returncode


def compare(arguments, name, expected, groups):
    """Runs one job; whether it differs from what is recorded, and the lines that say so."""
    folder, begun = arguments.out.resolve() / name, time.monotonic()
    code = expected["exit"] if arguments.no_run else run_job(arguments.binary.resolve(), expected, folder)
    found = {"job": expected["job"], "command": expected["command"], **found_in(folder, code)}
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
    names = sorted(p.stem for p in EXPECTED.glob("*.toml") if p.stem != "tolerances")
    wrong = False
    jobs = {p.relative_to(ROOT / "examples").as_posix() for kind in ("job", "tune") for p in ROOT.glob(f"examples/*/{kind}.toml")}
    told = {name: tomllib.loads((EXPECTED / f"{name}.toml").read_text(encoding="utf-8")) for name in names}
    for job in sorted(jobs ^ {e["job"] for e in told.values()}):
        wrong = True
        print(f"{job}: in examples/ or in examples/expected/, not in both")
    arguments.out.mkdir(parents=True, exist_ok=arguments.no_run)
    chosen = arguments.only.split(",") if arguments.only else sorted(names, key=lambda n: (n not in LONGEST, n))
    with concurrent.futures.ThreadPoolExecutor(RUNS) as pool:
        runs = [pool.submit(compare, arguments, name, told[name], groups) for name in chosen if name in told]
        for run in concurrent.futures.as_completed(runs):
            differs, lines = run.result()
            print(*lines, sep="\n", flush=True)
            wrong |= differs and not arguments.record
    sys.exit(wrong)


main()
