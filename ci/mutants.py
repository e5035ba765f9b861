#!/usr/bin/env python3
"""Mutation tests of the numeric rooms by cargo-mutants: what the room's own tests do not notice when the code is changed.

    ci/mutants.py --rooms deposition robot --count 100    a seeded sample of each room
    ci/mutants.py --changed --minutes 4                   of what changed since the state that landed last: what CI runs

Changes the working tree while it runs and puts it back; so it starts from a clean one only. A survivor fails the run, unless
ci/mutants.toml lists it with its reason. The order is that of hashes of the seed, the text of the line and the change: the same
seed chooses the same mutants of unchanged lines, wherever they have moved.
"""

import argparse, functools, hashlib, json, math, os, pathlib, resource, shutil, signal, subprocess, sys, tempfile, time, tomllib

ROOMS = "numerics geometry toolpath planning control robot scan-head gun deposition thermal melt-strategy perception".split()
ROOT = pathlib.Path(__file__).resolve().parent.parent
# bytes of address space for the tests of one mutant: some loop and fill memory
MEMORY = 12 << 30


@functools.cache
def lines(file):
    return (ROOT / file).read_text().splitlines()


def key(mutant):
    """File, text of the changed line, change: what stays when lines move."""
    line = lines(mutant["file"])[mutant["span"]["start"]["line"] - 1]
    return mutant["file"], line.strip(), mutant["name"].split(": ", 1)[1]


def listed():
    """The survivors that are accepted, each with its reason."""
    rows = tomllib.loads((ROOT / "ci" / "mutants.toml").read_text()).get("accepted", [])
    if any(not row["reason"].strip() for row in rows):
        sys.exit("ci/mutants.toml: an accepted mutant without a reason")
    return {(row["file"], row["line"], row["change"]) for row in rows}


def landed():
    """The state that landed last: where this branch left the main one, or the first parent; none in a clone without history."""
    head = git("rev-parse", "HEAD")
    bases = [git("merge-base", "HEAD", main) for main in ("origin/main", "main")] + [git("rev-parse", "--verify", "HEAD^")]
    return next((base for base in bases if base not in ("", head)), None)


def git(*words):
    """What git says; nothing where it fails."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True).stdout.strip()


def mutants_of(rooms, since):
    """All mutants of some rooms, or those in what changed since a revision; without those that are accepted."""
    command = ["cargo", "mutants", "--list", "--json"] + [word for room in rooms for word in ("-p", f"meltpath-{room}")]
    with tempfile.NamedTemporaryFile() as changed:
        if since:
            paths = [f"crates/{room}/src" for room in rooms]
            subprocess.run(["git", "diff", since, "--", *paths], cwd=ROOT, stdout=changed, check=True)
            if not os.path.getsize(changed.name):
                return []
            command += ["--in-diff", changed.name]
        found = json.loads(subprocess.check_output(command, cwd=ROOT) or "[]")
    accepted = listed()
    return [m for m in found if key(m) not in accepted]


def sample(mutants, skip, count, seed):
    def order(mutant):
        words = (str(seed), *key(mutant), str(mutant["span"]["start"]["column"]))
        return hashlib.sha256("\n".join(words).encode()).digest()

    return sorted(mutants, key=order)[skip : skip + count]


# what is tried on a mutant, one after the other until one notices: unit tests, the room's other tests, examples in docstrings;
# with the processor seconds that each program of tests may take (sound ones take a fifth to a half): some mutants never end
STEPS = {"--lib": 20, "--tests": 150, "--doc": 60}
# s; for those that wait for ever
PATIENCE = 1200


def ends(command, seconds):
    """The exit code of a command whose programs may take `seconds` of a processor each."""
    # a case that fails need not be made small: a mutant is caught either way
    quick = os.environ | {"PROPTEST_MAX_SHRINK_ITERS": "0"}

    def bounded():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))

    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen(command, cwd=ROOT, env=quick, start_new_session=True, preexec_fn=bounded, **silent)
    try:
        return process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        return 1
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def notice(mutant):
    """How a mutant in place ends: caught, unviable where it does not build, or missed."""
    test = ["cargo", "test", "--quiet", "-p", mutant["package"]]
    for step, seconds in STEPS.items():
        if step != "--doc" and ends([*test, step, "--no-run"], PATIENCE):
            return "unviable"
        if ends([*test, step], seconds):
            return "caught"
    return "missed"


def outcome(mutant):
    """Puts a mutant in place, tries it, and puts the file back."""
    path = ROOT / mutant["file"]
    sound = path.read_bytes()
    try:
        subprocess.run(["patch", "--silent", "--no-backup-if-mismatch", path], input=mutant["diff"], text=True, check=True)
        return notice(mutant)
    finally:
        path.write_bytes(sound)


def run(chosen, minutes):
    """The mutants that were tried in the time, each with its outcome."""
    end = time.monotonic() + 60 * minutes
    tried = []
    for mutant in chosen:
        if time.monotonic() > end:
            break
        start = time.monotonic()
        tried.append((mutant, outcome(mutant)))
        print(f"{tried[-1][1]} {mutant['name']} ({time.monotonic() - start:.0f} s)", file=sys.stderr, flush=True)
    # cases that property tests found and kept
    for undo in (["checkout", "-q"], ["clean", "-fdq"]):
        subprocess.run(["git", *undo, "--", "crates"], cwd=ROOT, check=True)
    return tried


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", nargs="+", choices=ROOMS, default=ROOMS)
    parser.add_argument("--changed", action="store_true", help="only what changed since the state that landed last")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--skip", type=int, default=0, help="leave out the first of the sample: those tried before")
    parser.add_argument("--seed", type=int, default=12)
    parser.add_argument("--minutes", type=float, default=math.inf, help="start none after so long, a room")
    parser.add_argument("--list", action="store_true", help="show the sample, run nothing")
    options = parser.parse_args()
    if shutil.which("cargo-mutants") is None:
        print("no cargo-mutants is installed (cargo install cargo-mutants --locked): mutation tests are skipped")
        return 0
    if not options.list and subprocess.check_output(["git", "status", "--porcelain", "--", "crates"], cwd=ROOT):
        sys.exit("the working tree has changes under crates/: commit them first")
    since = landed() if options.changed else None
    if options.changed and since is None:
        print("this clone has no history: mutation tests of what changed are skipped")
        return 0
    mutants = mutants_of(options.rooms, since)
    groups = [mutants] if since else [[m for m in mutants if m["package"] == f"meltpath-{r}"] for r in options.rooms]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # the file is put back on the way out
    missed = 0
    for group in groups:
        # room by room, so that each is built once
        chosen = sorted(sample(group, options.skip, options.count, options.seed), key=lambda m: m["package"])
        if not chosen:
            print("no mutant in what changed")
            continue
        if options.list:
            print("\n".join(m["name"] for m in chosen))
            continue
        outcomes = run(chosen, options.minutes)
        survivors = [m for m, end in outcomes if end == "missed"]
        viable = [m for m, end in outcomes if end != "unviable"]
        rooms = " ".join(sorted({m["package"].removeprefix("meltpath-") for m in chosen}))
        share = f"{100 * (len(viable) - len(survivors)) / len(viable):.0f} %" if viable else "-"
        print(f"{rooms}: {len(group)} mutants, {len(viable)} tried, {len(viable) - len(survivors)} caught, {share}", flush=True)
        for m in survivors:
            print(f"  survives: {m['name']}\n    {key(m)[1]}", flush=True)
        missed += len(survivors)
    if missed:
        print(f"{missed} survive: a test that fails with each, or a row with its reason in ci/mutants.toml")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
