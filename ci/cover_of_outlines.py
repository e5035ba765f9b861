#!/usr/bin/env python3
"""How much of outlines lies under beads: the tracked number of `docs/theory/slicing-and-filling.md`.

    cargo build --release -p meltpath-planning --example outlines
    python3 ci/cover_of_outlines.py target/release/examples/outlines [FOLDER]

Fills a hundred outlines that are made here from a seed, and every `.wkt` file of FOLDER (such as CuraEngine's
`stress_benchmark/resources`, in micrometres), 15 times as large so that a printer's line of 0.4 mm is a bead of 6.5 mm: prisms of one
section and two layers, beads 6.5 mm wide and 4.8 mm apart. Bare is what no bead covers; of it, in corners and where the section is
narrower than a bead is what no round bead reaches.
"""

import math
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile

SCALE = 15e-3  # micrometres of a printer's outline to millimetres of ours
BEAD, APART, HEIGHT, LAYERS = 6.5, 4.8, 2.0, 2


def rings_of_wkt(text):
    """The rings of the polygons of a file, mm."""
    rings = []
    for ring in re.findall(r"\(([-\d.eE+,\s]+)\)", text):
        points = [tuple(float(v) * SCALE for v in p.split()[:2]) for p in ring.split(",") if p.strip()]
        if len(points) > 1 and points[0] == points[-1]:
            points.pop()
        if len(points) > 2:
            rings.append(points)
    return rings


def star(r, size):
    count = r.randrange(3, 14)
    inner = r.uniform(0.25, 0.9)
    return [
        (
            size * (1.0 if i % 2 else inner) * math.cos(math.pi * i / count),
            size * (1.0 if i % 2 else inner) * math.sin(math.pi * i / count),
        )
        for i in range(2 * count)
    ]


def blob(r, size):
    waves = [(r.randrange(1, 9), r.uniform(0, 0.25), r.uniform(0, 6.3)) for _ in range(3)]
    ring = []
    for i in range(240):
        a = 2 * math.pi * i / 240
        d = size * (1 + sum(h * math.sin(n * a + p) for n, h, p in waves))
        ring.append((d * math.cos(a), d * math.sin(a)))
    return ring


def comb(r, size):
    teeth, deep = r.randrange(2, 7), r.uniform(0.3, 0.85)
    wide = 2 * size / (2 * teeth - 1)
    ring = [(-size, -size), (size, -size)]
    for i in reversed(range(teeth)):
        left = -size + 2 * i * wide
        ring += [(left + wide, size), (left, size)]
        if i:
            ring += [(left, size * (1 - 2 * deep)), (left - wide, size * (1 - 2 * deep))]
    return ring


def steps(r, size):
    """Rectangles of random widths on one another: no two of which are equally wide."""
    heights = sorted(r.uniform(-size, size) for _ in range(r.randrange(2, 6)))
    heights = [-size, *heights, size]
    right, left = [], []
    for low, high in zip(heights, heights[1:]):
        a, b = r.uniform(0.15, 1.0) * size, r.uniform(0.15, 1.0) * size
        right += [(a, low), (a, high)]
        left += [(-b, low), (-b, high)]
    return right + left[::-1]


def ring_with_holes(r, size):
    outer = blob(r, size)
    holes = []
    for _ in range(r.randrange(1, 4)):
        a, d, radius = r.uniform(0, 6.3), r.uniform(0, 0.4) * size, r.uniform(0.05, 0.2) * size
        hole = [
            (d * math.cos(a) + radius * math.cos(-2 * math.pi * i / 60), d * math.sin(a) + radius * math.sin(-2 * math.pi * i / 60))
            for i in range(60)
        ]
        apart = all(math.dist(hole[0], other[0]) > 0.5 * size for other in holes)
        if apart:
            holes.append(hole)
    return [outer, *holes]


def made(count):
    """Outlines from a seed: name and rings."""
    r = random.Random(20261130)
    kinds = [("star", star), ("blob", blob), ("comb", comb), ("steps", steps), ("holes", ring_with_holes)]
    for n in range(count):
        name, make = kinds[n % len(kinds)]
        rings = make(r, r.uniform(20, 120))
        yield f"{name}-{n:03}", rings if isinstance(rings[0], list) else [rings]


def write_prism(path, rings):
    """The walls of a prism; its sections need no lids."""
    top, facets = HEIGHT * LAYERS, []
    for ring in rings:
        for a, b in zip(ring, ring[1:] + ring[:1]):
            if a != b:
                low, high = [(*a, 0.0), (*b, 0.0)], [(*a, top), (*b, top)]
                facets += [(low[0], low[1], high[1]), (low[0], high[1], high[0])]
    with open(path, "wb") as out:
        out.write(b"walls".ljust(80) + struct.pack("<I", len(facets)))
        for facet in facets:
            out.write(struct.pack("<12f", 0, 0, 0, *(v for p in facet for v in p)) + b"\0\0")


def told(name, rows):
    """Mean, median and least cover of a set, by area and shape by shape."""
    area = sum(a for _, a, _, _ in rows)
    cover = sorted(100 - bare for _, _, bare, _ in rows)
    reach = sorted(100 - within for _, _, _, within in rows)
    mean = 100 - sum(a * bare for _, a, bare, _ in rows) / area
    within = 100 - sum(a * w for _, a, _, w in rows) / area
    print(
        f"{name}: {len(rows)} outlines, covered {mean:.2f} % of the area ({within:.2f} % of what a round bead reaches); "
        f"shape by shape least {cover[0]:.2f}, tenth {cover[len(cover) // 10]:.2f}, median {cover[len(cover) // 2]:.2f} %; "
        f"of what is reached least {reach[0]:.2f}, tenth {reach[len(reach) // 10]:.2f}, median {reach[len(reach) // 2]:.2f} %"
    )
    for name, _, bare, within in sorted(rows, key=lambda r: -r[3])[:5]:
        print(f"  {name}: {100 - bare:.2f} %, {100 - within:.2f} % of what is reached")


def main():
    program, *folders = sys.argv[1:]
    sets = {"made": list(made(100))}
    for folder in folders:
        files = sorted(pathlib.Path(folder).glob("*.wkt"))
        sets[folder] = [(f.stem, rings_of_wkt(f.read_text())) for f in files]
    for name, outlines in sets.items():
        with tempfile.TemporaryDirectory() as folder:
            paths = []
            for stem, rings in outlines:
                paths.append(pathlib.Path(folder) / f"{stem}.stl")
                write_prism(paths[-1], rings)
            arguments = [program, str(BEAD), str(APART), str(HEIGHT), *map(str, paths)]
            printed = subprocess.run(arguments, capture_output=True, text=True, check=True).stdout
        rows = []
        for line in printed.splitlines()[1:]:
            part, _, _, area, _, _, bare, within, _ = line.rsplit(maxsplit=8)
            rows.append((pathlib.Path(part).stem, float(area), float(bare), float(within)))
        if rows:
            told(name, rows)


if __name__ == "__main__":
    main()
