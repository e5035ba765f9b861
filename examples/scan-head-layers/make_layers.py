"""Writes ring.cli: three layers of a ring as another CAM would, two contours and hatches at 0.1 mm turned by 67 degrees a layer."""
import math

OUTER, INNER, HATCH, INSET, CHORD, SHIFT = 6.0, 3.5, 0.1, 0.2, 0.3, 100.0


def circle(radius, direction):
    n = round(2 * math.pi * radius / CHORD)
    points = [(radius * math.cos(2 * math.pi * k / n), direction * radius * math.sin(2 * math.pi * k / n)) for k in range(n)]
    return points + points[:1]


def polyline(points, direction):
    flat = ",".join(f"{c + SHIFT:.4f}" for p in points for c in p)
    return f"$$POLYLINE/1,{direction},{len(points)},{flat}"


def hatches(angle):
    c, s = math.cos(angle), math.sin(angle)
    outer, inner, lines = OUTER - INSET, INNER + INSET, []
    count = int(2 * outer / HATCH)
    for k in range(count):
        y = -outer + (k + 0.5) * HATCH
        reach = math.sqrt(outer**2 - y**2)
        hole = math.sqrt(max(inner**2 - y**2, 0.0))
        pieces = [(-reach, -hole), (hole, reach)] if hole else [(-reach, reach)]
        if k % 2:
            pieces = [(b, a) for a, b in reversed(pieces)]
        lines += [[(c * x - s * y, s * x + c * y) for x in piece] for piece in pieces]
    flat = ",".join(f"{v + SHIFT:.4f}" for line in lines for p in line for v in p)
    return f"$$HATCHES/1,{len(lines)},{flat}"


with open("ring.cli", "w", newline="\n") as out:
    out.write("$$HEADERSTART\n$$ASCII\n$$UNITS/1\n$$VERSION/200\n$$LABEL/1,ring\n$$LAYERS/3\n$$HEADEREND\n$$GEOMETRYSTART\n")
    for layer in range(3):
        out.write(f"$$LAYER/{0.03 * (layer + 1):.2f}\n")
        out.write(polyline(circle(OUTER, 1), 1) + "\n" + polyline(circle(INNER, -1), 0) + "\n")
        out.write(hatches(math.radians(67 * layer)) + "\n")
    out.write("$$GEOMETRYEND\n")
