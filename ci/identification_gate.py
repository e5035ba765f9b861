"""Runs the gate of docs/validation.md, "Motors over many records": motors found from records of another simulator, and how far off.

    python3 ci/identification_gate.py OUT              runs records 0 to 199 into the folder OUT, two pieces at a time, and prints the table
    python3 ci/identification_gate.py OUT --no-run     prints the table of what OUT holds
    options: --records FROM..TO (default 0..200)

A piece is five records, a minute of a core; one that OUT holds whole is not run again.
"""
import concurrent.futures
import json
import math
import pathlib
import re
import subprocess
import sys

TEST = "identification_time::records_of_another_simulator_give_their_motors_within_the_stated_deviations"
BUILD = ["cargo", "test", "--release", "-p", "meltpath-scan-head", "--test", "all", "--no-run", "--message-format=json"]
PIECE = 5
NAMES = (
    "resistance", "inductance", "torque constant", "inertia", "viscous", "pulsation of the mode", "damping of the mode", "gain of the mode",
    "Coulomb torque", "bias", "delay of current", "delay of angle", "share of friction that the mode feels",
)
ROW = re.compile(r"^(\d+): off, stated (\[\[.*\]\])$", re.M)
LEFT = re.compile(r"(\d+): \d+ kHz, [\d.]+ s, (\d+) modes, over noise \[Some\(([\d.]+)\), Some\(([\d.]+)\)\]")


def program():
    listed = subprocess.run(BUILD, stdout=subprocess.PIPE, text=True, check=True).stdout
    messages = map(json.loads, listed.splitlines())
    return [m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "all"][0]


def name(out, first):
    return out / f"part-{first:03}.txt"


def run(executable, out, first, last):
    file = name(out, first)
    if file.exists() and len(LEFT.findall(file.read_text())) == last - first:
        return
    command = ["env", f"MELTPATH_RECORDS={first}..{last}", "RAYON_NUM_THREADS=1", executable, "--ignored", "--exact", TEST, "--nocapture"]
    with file.open("w") as into:
        # a piece whose records are far off fails by itself: the table tells it
        subprocess.run(command, stdout=into, stderr=subprocess.STDOUT, check=False)


def table(out):
    text = "\n".join(file.read_text() for file in sorted(out.glob("part-*.txt")))
    rows = {int(seed): json.loads(found) for seed, found in ROW.findall(text)}
    left = LEFT.findall(text)
    over = [float(value) for found in left for value in found[2:]]
    print(f"{len(left)} records, {len(rows)} with their mode; without: {[int(f[0]) for f in left if f[1] == '0']}")
    print(f"what is left over the noise: {min(over):.3f} to {max(over):.3f}\n")
    print("| parameter | within two deviations | stated over scatter | farthest, deviations (record) |\n|---|---|---|---|")
    for k, what in enumerate(NAMES):
        off = [(abs(found[k][0]), seed) for seed, found in rows.items()]
        within = sum(o < 2 for o, _ in off) / len(off)
        scatter = math.sqrt(sum(o * o for o, _ in off) / len(off))
        far, seed = max(off)
        print(f"| {what} | {100 * within:.1f} % | {1 / scatter:.2f} | {far:.1f} ({seed}) |")


def main():
    arguments = sys.argv[1:]
    out = pathlib.Path(arguments[0])
    first, last = (0, 200)
    if "--records" in arguments:
        first, last = map(int, arguments[arguments.index("--records") + 1].split(".."))
    if "--no-run" not in arguments:
        out.mkdir(parents=True, exist_ok=True)
        executable = program()
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            begins = range(first, last, PIECE)
            list(pool.map(lambda a: run(executable, out, a, min(a + PIECE, last)), begins))
    table(out)


if __name__ == "__main__":
    main()
