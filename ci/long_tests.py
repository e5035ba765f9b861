"""Runs the long validations (tests that are `#[ignore]`d), two programs of them at a time.

    python3 ci/long_tests.py cargo test --release --workspace

The arguments are the command that builds the tests. cargo itself runs one program after the other, and each ends with one test on one
core: two at a time use both. What each prints is printed when it ends.
"""
import concurrent.futures
import json
import pathlib
import subprocess
import sys

# rooms with minutes of them: started last they would run alone
LONGEST = ("meltpath", "melt-strategy")


def programs(command):
    """The test programs and the folders in which cargo runs them, those that take longest first."""
    listed = subprocess.run([*command, "--no-run", "--message-format=json"], stdout=subprocess.PIPE, text=True, check=True).stdout
    found = []
    for line in listed.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["profile"]["test"]:
            found.append((message["executable"], pathlib.Path(message["manifest_path"]).parent))
    return sorted(found, key=lambda p: (p[1].name not in LONGEST, p[0]))


def run(executable, folder):
    done = subprocess.run([executable, "--ignored", "--test-threads", "1"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    # a program without long tests says nothing worth reading
    return done.returncode, "" if "running 0 tests" in done.stdout else f"{executable}\n{done.stdout}"


def main():
    failed = False
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        runs = [pool.submit(run, executable, folder) for executable, folder in programs(sys.argv[1:])]
        for done in concurrent.futures.as_completed(runs):
            code, said = done.result()
            print(said, end="", flush=True)
            failed |= code != 0
    sys.exit(failed)


if __name__ == "__main__":
    main()
