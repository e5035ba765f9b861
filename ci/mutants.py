#!/usr/bin/env python3
"""Mutation tests of the numeric rooms: what the room's own tests do not notice when the code is changed.

    ci/mutants.py --rooms deposition robot --count 100    a seeded sample of each room
    ci/mutants.py --changed --minutes 4                   of what changed since the state that landed last: what CI runs

All mutants of a room are built at once, each behind a switch that a variable of the environment turns on; then each is tried on
the tests that reach it. Changes the working tree while it builds and puts it back; so it starts from a clean one only. A survivor
fails the run, unless ci/mutants.toml accepts it with its reason; one that it lists as open is told as such, and counts. The order is that of hashes of the seed, the text of the line and
the change: the same seed chooses the same mutants of unchanged lines, wherever they have moved.
"""

import argparse, collections, hashlib, json, math, os, pathlib, re, resource, signal, subprocess, sys, tempfile, threading, time, tomllib

try:
    from weave_mutants import SWITCH, marks_around, mutants_of, woven
except ImportError:
    sys.exit("ci/mutants.py needs tree-sitter: ci/setup.sh, then target/ci-venv/bin/python ci/mutants.py …")

ROOMS = "numerics geometry toolpath planning control robot scan-head gun deposition thermal melt-strategy perception".split()
ROOT = pathlib.Path(__file__).resolve().parent.parent
# bytes of address space for the tests of one mutant: some loop and fill memory
MEMORY = 12 << 30
# processor seconds for a program of tests of one mutant, and how many times those that it takes without: some never end
SECONDS, TIMES = 10, 4
# s; for those that wait for ever
PATIENCE = 1200
# threads of pools, and of examples in docstrings
UNNAMED = {"?", "main"}


def listed(kind, words):
    """The survivors of a kind, each with what is said of it: `accepted` with a reason, `open` with the test that is missing."""
    rows = tomllib.loads((ROOT / "ci" / "mutants.toml").read_text()).get(kind, [])
    if any(not row[words].strip() for row in rows):
        sys.exit(f"ci/mutants.toml: an {kind} mutant without its {words}")
    return {(row["file"], row["line"], row["change"]): row[words] for row in rows}


def git(*words):
    """What git says; nothing where it fails."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True).stdout.strip()


def landed():
    """The state that landed last: where this branch left the main one, or the first parent; none in a clone without history."""
    head = git("rev-parse", "HEAD")
    bases = [git("merge-base", "HEAD", main) for main in ("origin/main", "main")] + [git("rev-parse", "--verify", "HEAD^")]
    return next((base for base in bases if base not in ("", head)), None)


def changed_lines(since):
    """Files and lines that came since a revision."""
    lines, file = set(), ""
    for row in git("diff", "--unified=0", since, "--", "crates").splitlines():
        if row.startswith("+++ "):
            file = row[6:]
        elif hunk := re.match(r"@@ .* \+(\d+)(?:,(\d+))? @@", row):
            lines |= {(file, int(hunk[1]) + n) for n in range(int(hunk[2] or 1))}
    return lines


def of_room(room, since):
    """The mutants of a room that are not accepted: all, or those in what came since a revision."""
    accepted, lines = listed("accepted", "reason"), changed_lines(since) if since else None
    for path in sorted((ROOT / "crates" / room / "src").rglob("*.rs")):
        for mutant in mutants_of(str(path.relative_to(ROOT)), path.read_bytes()):
            if mutant.key not in accepted and (lines is None or (mutant.file, mutant.line) in lines):
                yield mutant


def sample(mutants, skip, count, seed):
    def order(mutant):
        return hashlib.sha256("\n".join((str(seed), *mutant.key, str(mutant.column))).encode()).digest()

    return dict(enumerate(sorted(mutants, key=order)[skip : skip + count], 1))


def weave(room, mutants):
    """Writes mutants into the files of a room."""
    files = collections.defaultdict(dict)
    for number, mutant in mutants.items():
        files[mutant.file][number] = mutant
    for file, chosen in files.items():
        (ROOT / file).write_text(woven((ROOT / file).read_bytes(), chosen))
    with open(ROOT / "crates" / room / "src" / "lib.rs", "a") as lib:
        lib.write(SWITCH)


def put_back(room):
    """The files of a room as they are committed, without cases that property tests found and kept."""
    for undo in (["checkout", "-q"], ["clean", "-fdq"]):
        subprocess.run(["git", *undo, "--", f"crates/{room}"], cwd=ROOT, check=True)


def messages(room):
    """What cargo says of the tests of a room, as they are built."""
    command = ["cargo", "test", "--release", "--no-run", "--quiet", "--message-format=json", "-p", f"meltpath-{room}"]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    return [json.loads(row) for row in built.stdout.splitlines() if row.startswith("{")], built


def called_from(span):
    """Where a macro was called, if a place lies in one of another library."""
    while span["expansion"] and not span["file_name"].startswith("crates/"):
        span = span["expansion"]["span"]
    return span


def unbuildable(found):
    """The mutants that errors of the compiler point at."""
    bad = set()
    for message in (m["message"] for m in found if m["reason"] == "compiler-message"):
        spans = [called_from(s) for s in message["spans"] if s["is_primary"]]
        spans = [s for s in spans if s["file_name"].startswith("crates/")]
        if message["level"] == "error" and spans:
            bad |= set(marks_around((ROOT / spans[0]["file_name"]).read_text(), spans[0]["byte_start"]))
    return bad


def build(room, mutants):
    """The programs of tests with all mutants in them that can be built, and these mutants."""
    for _ in range(40):
        weave(room, mutants)
        found, built = messages(room)
        bad = unbuildable(found) if built.returncode else set()
        if built.returncode == 0:
            # an example of the room is built beside its tests, and is none
            tests = [m for m in found if m.get("executable") and m["profile"]["test"]]
            return [m["executable"] for m in tests], mutants
        put_back(room)
        if not bad & mutants.keys():
            sys.exit(f"the mutants of {room} do not build:\n{built.stderr[-3000:]}")
        mutants = {number: mutant for number, mutant in mutants.items() if number not in bad}
    sys.exit(f"the mutants of {room} do not build in 40 tries")


def fails(command, room, seconds, **variables):
    """Whether tests fail within some processor seconds, with what is switched on."""
    # a case that fails need not be made small: a mutant is caught either way
    environment = os.environ | {"PROPTEST_MAX_SHRINK_ITERS": "0", "MELTPATH_FUZZ_SECONDS": "1"} | variables

    def bounded():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    silent = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    where = ROOT / "crates" / room
    process = subprocess.Popen(command, cwd=where, env=environment, start_new_session=True, preexec_fn=bounded, **silent)
    late = threading.Timer(PATIENCE, os.killpg, (process.pid, signal.SIGKILL))
    late.start()
    try:
        # the first test that fails tells: the others need not end
        if any(row.startswith(b"test ") and row.endswith(b" FAILED\n") for row in process.stdout):
            return True
        return process.wait() != 0
    finally:
        late.cancel()
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def reached(command, room):
    """Which tests reach which mutants, and the processor seconds that a mutant may take."""
    with tempfile.NamedTemporaryFile() as told:
        before = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
        if fails(command, room, PATIENCE, MELTPATH_REACHED=told.name):
            sys.exit(f"the tests of {room} fail without any mutant: {' '.join(map(str, command))}")
        by_number = collections.defaultdict(set)
        for row in pathlib.Path(told.name).read_text().splitlines():
            number, _, thread = row.partition(" ")
            by_number[int(number)].add(thread)
    took = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2]) - before
    return by_number, math.ceil(SECONDS + TIMES * took)


def is_caught(number, programs, room):
    """Whether a mutant is noticed: by the tests that reach it themselves, or from threads that bear no test's name."""
    on = {"MELTPATH_MUTANT": str(number)}
    by_name, whole = [], []
    for program, (by_number, seconds) in programs:
        tests = sorted(by_number[number] - UNNAMED)
        if tests and len(program) == 1:
            by_name.append(([*program, "--exact", *tests], seconds))
        if by_number[number] & UNNAMED or by_number[number] and len(program) > 1:
            whole.append((program, seconds))
    return any(fails(command, room, seconds, **on) for command, seconds in by_name + whole)


def outcomes(room, mutants, end):
    """The mutants that were tried before a time, each with how it ended: caught, missed, or unviable where it does not build."""
    try:
        executables, viable = build(room, mutants)
        documented = ["cargo", "test", "--release", "--quiet", "--doc", "-p", f"meltpath-{room}"]
        programs = [(program, reached(program, room)) for program in [*([e] for e in executables), documented]]
        ends = {number: "unviable" for number in mutants.keys() - viable.keys()}
        for number in viable:
            if time.monotonic() > end:
                break
            start = time.monotonic()
            ends[number] = "caught" if is_caught(number, programs, room) else "missed"
            print(f"{ends[number]} {mutants[number].name} ({time.monotonic() - start:.0f} s)", file=sys.stderr, flush=True)
        return ends
    finally:
        put_back(room)


def tell(room, mutants, known, ends):
    """Says how the mutants of a room ended; how many are missed."""
    missed = [mutants[number] for number in sorted(ends) if ends[number] == "missed"]
    told = listed("open", "missing")
    caught = {mutants[number].key for number, end in ends.items() if end == "caught"}
    tried = sum(end != "unviable" for end in ends.values())
    share = f"{100 * (tried - len(missed)) / tried:.0f} %" if tried else "-"
    print(f"{room}: {known} mutants, {tried} tried, {tried - len(missed)} caught, {share}", flush=True)
    for mutant in missed:
        print(f"  survives: {mutant.name}\n    {mutant.text}", flush=True)
        if mutant.key in told:
            print(f"    known as open: {told[mutant.key]}", flush=True)
    for key in sorted(told.keys() & caught):
        print(f"  caught, take its open row from ci/mutants.toml: {key[0]}: {key[2]}", flush=True)
    return len(missed)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", nargs="+", choices=ROOMS, default=ROOMS)
    parser.add_argument("--changed", action="store_true", help="only what changed since the state that landed last")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--skip", type=int, default=0, help="leave out the first of the sample: those tried before")
    parser.add_argument("--seed", type=int, default=12)
    parser.add_argument("--minutes", type=float, default=math.inf, help="start none after so long")
    parser.add_argument("--list", action="store_true", help="show the sample, run nothing")
    options = parser.parse_args()
    if not options.list and subprocess.check_output(["git", "status", "--porcelain", "--", "crates"], cwd=ROOT):
        sys.exit("the working tree has changes under crates/: commit them first")
    since = landed() if options.changed else None
    if options.changed and since is None:
        print("this clone has no history: mutation tests of what changed are skipped")
        return 0
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # the files are put back on the way out
    found = {room: list(of_room(room, since)) for room in options.rooms}
    count = sum(map(len, found.values())) if since else 0
    end, missed = time.monotonic() + 60 * options.minutes, 0
    # of what changed, the rooms with most of it first, each with its part of the whole sample
    for room, known in sorted(found.items(), key=lambda entry: -len(entry[1]) if since else 0):
        share = math.ceil(options.count * len(known) / count) if since and count else options.count
        mutants = sample(known, options.skip, share, options.seed)
        if options.list:
            print("\n".join(mutant.name for mutant in mutants.values()))
        elif mutants and time.monotonic() < end:
            missed += tell(room, mutants, len(known), outcomes(room, mutants, end))
    if missed:
        print(f"{missed} survive: a test that fails with each, or a row with its reason in ci/mutants.toml")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
