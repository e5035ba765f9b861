"""Programs of others: makes the list, and simulates what stands in it.

    python3 bench/programs/programs.py list CLONES > bench/programs/list.csv
    python3 bench/programs/programs.py run CLONES first|second|both OUT.csv [COMMAND...]

CLONES holds clones of public repositories, one folder each, named owner+name (the git directory itself, or one with `.git` or `repo` in it).
No program is kept here: the list holds addresses and hashes alone, and a file whose hash differs is not run.
"""
import collections, concurrent.futures, csv, hashlib, json, os, pathlib, re, shutil, subprocess, sys, tempfile, threading

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIST = pathlib.Path(__file__).with_name("list.csv")
FIELDS = ["repository", "commit", "path", "sha256", "half"]
NAME = re.compile(r"\.(ls|tp|txt|ls\.txt|ls\.bak)$", re.I)
ARC = re.compile(rb"\b(arc|weld)\s+(start|end)\s*(e\d\s*)?\[|\bWELD_SPEED\b", re.I)
MOTION = re.compile(rb"^[ \t\d]*:[ \t]*[JLCA][ \t]+PR?\[", re.I | re.M)
CALL = re.compile(rb"\bCALL\s+([A-Za-z0-9_-]+)", re.I)
LIMIT_S = 300
LOCK = threading.Lock()

# What a program does not tell and its user would, the same for all: the wire and gas (examples/thin-wall), what every weld and weave schedule sets.
# The plate, the arm and registers are not told. The part is thin-wall's, so checks against the part mean nothing here.
SCHEDULES = "".join(f'\n[[program.schedule]]\nnumber = {n}\nwire_feed = "8 m/min"\ntravel_speed = "0.75 m/min"\n' for n in range(1, 33))
WEAVES = "".join(f'\n[[program.weave]]\nnumber = {n}\nshape = "sine"\nfrequency = "2 Hz"\namplitude = "3 mm"\n' for n in range(1, 11))

# An outcome's class by what meltpath answers, the first that fits.
CLASSES = [
    ("no program in text", r"not a FANUC program"),
    ("cannot be read", r"cannot read the program"),
    ("arc that ends where it is off, or not at all", r"the arc ends, but it is off|ends with the arc on"),
    ("welding moves without an arc", r"never starts the arc"),
    ("arc starts where it is on", r"the arc starts, but it is on"),
    ("arc on in a joint move", r"joint move with the arc"),
    ("decided by values of the controller", r"values that are not known here"),
    ("does not end", r"does not end"),
    ("position that is not in the program", r"is not in /POS|position PR|given by joints|is not taught"),
    ("called program missing", r"is called, but was not given"),
    ("frame not told", r"before any|was taught in"),
    ("no bead known for another reason", r"lays no bead"),
]


def git_directory(clones, repository):
    base = pathlib.Path(clones, repository.replace("/", "+"))
    return next((d for d in (base, base / "repo", base / ".git", base / "repo" / ".git") if (d / "HEAD").is_file()), None)


def git(directory, *words):
    return subprocess.run(["git", "-C", str(directory), *words], capture_output=True, check=True).stdout


def names(directory, commit):
    return [n for n in git(directory, "ls-tree", "-r", "-z", "--name-only", commit).decode("utf-8", "surrogateescape").split("\0") if NAME.search(n)]


def make_list(clones):
    """Every arc program with moves, once by content; the half is the parity of the hash's last digit, even first."""
    seen, writer = set(), csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(FIELDS)
    for folder in sorted(os.listdir(clones)):
        repository = folder.replace("+", "/", 1)
        directory = git_directory(clones, repository)
        if directory is None:
            continue
        commit = git(directory, "rev-parse", "HEAD").decode().strip()
        for name in names(directory, commit):
            text = git(directory, "show", f"{commit}:{name}")
            digest = hashlib.sha256(text).hexdigest()
            if text.lstrip().startswith(b"/PROG") and ARC.search(text) and MOTION.search(text) and digest not in seen:
                seen.add(digest)
                writer.writerow([repository, commit, name, digest, "second" if int(digest[-1], 16) % 2 else "first"])


def lay_out(clones, row, folder):
    """The programs beside the listed one, as the controller would hold them; the listed one's name there."""
    directory, at = git_directory(clones, row["repository"]), pathlib.PurePosixPath(row["path"])
    for name in names(directory, row["commit"]):
        path = pathlib.PurePosixPath(name)
        if path.parent == at.parent and (path == at or path.suffix.lower() == ".ls"):
            (folder / path.name).write_bytes(git(directory, "show", f"{row['commit']}:{name}"))
    return at.name


def main_of(folder, name):
    """The program that is run: the listed one, or the one that calls it, to any depth."""
    stem = lambda n: n.split(".")[0].upper()
    callers = {}
    for file in sorted(folder.iterdir()):
        for called in CALL.findall(file.read_bytes()):
            callers.setdefault(called.decode().upper(), file.name)
    passed = set()
    while stem(name) in callers and stem(name) not in passed and stem(callers[stem(name)]) != stem(name):
        passed.add(stem(name))
        name = callers[stem(name)]
    return name


def classed(answer, folder):
    """What became of a run: its class and why."""
    verdict = answer.get("verdict")
    if verdict:
        built = pathlib.Path(folder, answer["folder"], "as-built.stl")
        status = {c["status"] for c in verdict["checks"]}
        metal = built.is_file() and built.stat().st_size > 84
        unknown = any("not the whole program" in (c.get("reason") or "") for c in verdict["checks"])
        word = verdict.get("status") or ("fail" if "fail" in status else "cannot-say" if "cannot-say" in status else "pass")
        return ("metal, every line" if not unknown else "metal, lines left out and told") if metal else "no metal", word
    reason = " ".join(answer.get("errors", ["no answer"]))
    return next((c for c, pattern in CLASSES if re.search(pattern, reason)), "other refusal"), reason


def simulate(clones, row, job, command, done):
    """Runs the listed program, or the one that calls it, once however many files are its parts."""
    with tempfile.TemporaryDirectory() as at:
        folder = pathlib.Path(at)
        name = lay_out(clones, row, folder)
        if hashlib.sha256((folder / name).read_bytes()).hexdigest() != row["sha256"]:
            return "hash differs", "", name
        main = main_of(folder, name)
        key = (row["repository"], str(pathlib.PurePosixPath(row["path"]).parent), main)
        with LOCK:
            mine = key not in done
            future = done.setdefault(key, concurrent.futures.Future())
        if mine:
            future.set_result(answer_of(folder, main, job, command))
        return *future.result(), main


def answer_of(folder, main, job, command):
    words = [*command, "simulate", str(folder / main), "--job", str(job), "--json", "--threads", "1", "--out", str(folder / "run")]
    try:
        done = subprocess.run(["timeout", str(LIMIT_S), *words], capture_output=True, text=True, cwd=folder)
        if done.returncode == 124:
            return "over the time limit", f"{LIMIT_S} s"
        return classed(json.loads(done.stdout), folder)
    except ValueError:
        return "no answer", done.stderr[-300:]


def run(clones, half, out, command):
    with tempfile.TemporaryDirectory() as at:
        wall = shutil.copytree(ROOT / "examples/thin-wall", pathlib.Path(at, "job"))
        cell = (ROOT / "crates/data/cells/arcmate-120ic.toml").read_text()
        (wall / "cell.toml").write_text(cell + SCHEDULES + WEAVES)
        job = wall / "job.toml"
        job.write_text(job.read_text().replace("[machine]\n", '[machine]\ncell = "cell.toml"\n'))
        rows = [r for r in csv.DictReader(LIST.open()) if half in (r["half"], "both") and git_directory(clones, r["repository"])]
        rows.reverse()  # long chains of programs stand last in the list
        done = {}
        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            answers = list(pool.map(lambda r: simulate(clones, r, job, command, done), rows))
    with open(out, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["sha256", "class", "told", "main", "path"])
        writer.writerows([r["sha256"], a[0], a[1].replace(str(at), ""), a[2], r["path"]] for r, a in zip(rows, answers))
    counts = collections.Counter((r["half"], r["repository"], a[0]) for r, a in zip(rows, answers))
    for (part, repository, what), count in sorted(counts.items()):
        print(f"{part:7} {repository:32} {count:4} {what}")
    for part in sorted({r["half"] for r in rows}):
        mine = [a[0].startswith("metal") for r, a in zip(rows, answers) if r["half"] == part]
        print(f"{part:7} {sum(mine)} of {len(mine)} to metal")
    passed = [r["path"] for r, a in zip(rows, answers) if a[0] == "metal, lines left out and told" and a[1] == "pass"]
    return f"passes with lines left out: {passed}" if passed else 0


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "list":
        make_list(sys.argv[2])
    elif len(sys.argv) > 4 and sys.argv[1] == "run":
        sys.exit(run(sys.argv[2], sys.argv[3], sys.argv[4], sys.argv[5:] or [str(ROOT / "target/release/meltpath")]))
    else:
        sys.exit(__doc__)
