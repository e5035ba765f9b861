"""Writes the example parts of this folder as STEP files with OpenCASCADE (through CadQuery), and the propeller's blades as STL.

Run `python make_parts.py` here with `pip install cadquery`; meltpath itself needs neither.
All lengths are millimetres. The dates in the files are fixed, so that a second run writes the
same bytes.
"""

import math
import re
import struct
from pathlib import Path

import cadquery as cq

HERE = Path(__file__).resolve().parent


def flange() -> cq.Workplane:
    """Pipe flange: plate 160 x 20, hub 90 rising 45 above the plate, bore 60, six bolt holes 14."""
    plate_d, plate_t = 160.0, 20.0
    hub_d, hub_h = 90.0, 45.0
    bore_d, bolt_d, bolt_circle = 60.0, 14.0, 125.0
    fillet, s = 2.0, 2.0 * 0.5**0.5
    plate_r, hub_r, bore_r, top = plate_d / 2, hub_d / 2, bore_d / 2, plate_t + hub_h
    # half the section, turned: outer edges a real flange breaks, and the hub's root where it
    # carries its bending moment
    section = (
        cq.Workplane("XZ")
        .moveTo(bore_r, 0)
        .lineTo(plate_r, 0)
        .lineTo(plate_r, plate_t - fillet)
        .threePointArc(
            (plate_r - fillet + s, plate_t - fillet + s), (plate_r - fillet, plate_t)
        )
        .lineTo(hub_r + fillet, plate_t)
        .threePointArc(
            (hub_r + fillet - s, plate_t + fillet - s), (hub_r, plate_t + fillet)
        )
        .lineTo(hub_r, top - fillet)
        .threePointArc((hub_r - fillet + s, top - fillet + s), (hub_r - fillet, top))
        .lineTo(bore_r, top)
        .close()
    )
    body = section.revolve(360, (0, 0, 0), (0, 1, 0))
    body = (
        body.faces("<Z")
        .workplane()
        .polarArray(bolt_circle / 2, 0, 360, 6)
        .circle(bolt_d / 2)
        .cutThruAll()
    )
    return body


def bracket() -> cq.Workplane:
    """Ribbed angle bracket 140 x 90 x 60: base and upright 12 thick, two ribs 10 thick, two holes."""
    length, depth, height, thick = 140.0, 90.0, 60.0, 12.0
    rib_t, rib_y = 10.0, 45.0
    base = cq.Workplane("XY").box(length, depth, thick, centered=(True, False, False))
    upright = cq.Workplane("XY").box(length, thick, height, centered=(True, False, False))
    body = base.union(upright)
    for x in (-rib_y, rib_y):
        rib = (
            cq.Workplane("YZ", origin=(x - rib_t / 2, 0, 0))
            .moveTo(thick, thick)
            .lineTo(thick + 55.0, thick)
            .lineTo(thick, thick + 40.0)
            .close()
            .extrude(rib_t)
        )
        body = body.union(rib)
    # vertical corners of the base's free edge
    body = body.edges("|Z").edges(">Y").fillet(10.0)
    # one hole in the base between the ribs, one through the upright
    body = body.cut(cq.Workplane("XY").center(0, 55).circle(11.0).extrude(thick))
    body = body.cut(
        cq.Workplane("XZ", origin=(0, 0, 0)).center(0, 38).circle(9.0).extrude(-thick)
    )
    return body


def bridge() -> cq.Workplane:
    """Arch 16 x 4 x 8: two legs of 4 x 4, 8 apart, under a half ellipse 4 high at its feet and 6 in its middle."""
    return (
        cq.Workplane("XZ", origin=(0, 2, 0))
        .moveTo(-8, 0)
        .lineTo(-4, 0)
        .lineTo(-4, 4)
        .ellipseArc(4, 2, 0, 180, startAtCurrent=True, sense=-1)
        .lineTo(4, 0)
        .lineTo(8, 0)
        .lineTo(8, 8)
        .lineTo(-8, 8)
        .close()
        .extrude(4)
    )


def torus() -> cq.Workplane:
    """Quarter of a torus, 50 to the centre line of a tube of 15 (Campocasso 2017, eq. 1): begins upright on z = 0, bends to -x."""
    return (
        cq.Workplane("XY")
        .circle(15.0)
        .revolve(90, (-50, 0, 0), (-50, -1, 0))
    )


def dome() -> cq.Workplane:
    """Half of a ball of 45, cut where it is 15 round its axis: the head of a tank with room for a pipe."""
    radius, port = 45.0, 15.0
    height, s = (radius**2 - port**2) ** 0.5, radius * 0.5**0.5
    return (
        cq.Workplane("XZ")
        .lineTo(radius, 0)
        .threePointArc((s, s), (port, height))
        .lineTo(0, height)
        .close()
        .revolve(360, (0, 0, 0), (0, 1, 0))
    )


def pipe() -> cq.Workplane:
    """180 mm of pipe 114.3 x 8 along x."""
    return cq.Workplane("YZ").circle(57.15).circle(49.15).extrude(180).translate((-90, 0, 0))


def boss() -> cq.Workplane:
    """Boss of 36 on that pipe, 18 high all over: its face is left as round as the pipe, to be machined."""
    ring = cq.Workplane("YZ").circle(57.15 + 18).circle(57.15 - 1).extrude(180)
    return cq.Workplane("XY").circle(18).extrude(100).intersect(ring.translate((-90, 0, 0)))


def die() -> cq.Workplane:
    """Block 130 x 90 under a free-form face: a wave along x, bent along y."""

    def height(x: float, y: float) -> float:
        return 40 + 8 * math.cos(x / 45) + 0.0015 * y * y

    rows = [[cq.Vector(x, y, height(x, y)) for x in range(-70, 71, 14)] for y in range(-50, 51, 10)]
    face = cq.Face.makeSplineApprox(rows, tol=1e-3)
    below = cq.Workplane(cq.Solid.extrudeLinear(face, cq.Vector(0, 0, -100)))
    return cq.Workplane("XY").box(130, 90, 100, centered=(True, True, False)).intersect(below)


def die_worn() -> cq.Workplane:
    """That die with its worn place cut out clean by a ball of 120."""
    return die().cut(cq.Workplane("XY").sphere(60).translate((10, -2, 100)))


def branch() -> cq.Workplane:
    """Pipe of 60 that bends by 40 degrees on a radius of 150, with a branch of 48 at 50 degrees to the other side."""
    bend, turn, lean = 150.0, math.radians(40), math.radians(50)

    def on_bend(angle: float) -> tuple[float, float]:
        return bend * (1 - math.cos(angle)), 40 + bend * math.sin(angle)

    path = cq.Workplane("XZ").lineTo(0, 40).threePointArc(on_bend(turn / 2), on_bend(turn))
    trunk = cq.Workplane("XY").circle(30).sweep(path)
    plane = cq.Plane((0, 0, 45), (0, 1, 0), (-math.sin(lean), 0, math.cos(lean)))
    body = trunk.union(cq.Workplane(plane).circle(24).extrude(100))
    seam = [e for e in body.edges().vals() if e.geomType() not in ("CIRCLE", "LINE")]
    return body.newObject(seam).fillet(6)


def propeller() -> list[tuple]:
    """Triangles of three blades on a hub of 50 about z: helicoids, 52 degrees wide at the hub, narrower and turned forward outwards, to 170 across."""

    def place(k: int, out: float, across: float) -> tuple[float, float, float]:
        angle = math.radians(26 * (1 - 0.35 * out * out)) * (2 * across - 1)
        z = 35 + 200 * angle / (2 * math.pi) * (1 - 0.25 * out)
        turn = angle + 2 * math.pi * k / 3 + 0.25 * out
        radius = 25 + 60 * out
        return radius * math.cos(turn), radius * math.sin(turn), z

    rows, columns = 40, 30
    triangles = []
    for k in range(3):
        for i in range(rows):
            for j in range(columns):
                a, b = place(k, i / rows, j / columns), place(k, (i + 1) / rows, j / columns)
                c, d = place(k, (i + 1) / rows, (j + 1) / columns), place(k, i / rows, (j + 1) / columns)
                triangles += [(a, b, c), (a, c, d)]
    return triangles


def write_stl(triangles: list[tuple], name: str) -> None:
    """Writes a sheet of triangles as a binary STL, its normals left to the reader."""
    with open(HERE / f"{name}.stl", "wb") as file:
        file.write(b"\0" * 80 + struct.pack("<I", len(triangles)))
        for corners in triangles:
            numbers = (0.0, 0.0, 0.0, *(x for corner in corners for x in corner))
            file.write(struct.pack("<12fH", *numbers, 0))


def write(shape: cq.Workplane, name: str) -> None:
    """Writes one named part, with the time stamp and the running number of the writer removed."""
    assembly = cq.Assembly(shape, name=name)
    path = HERE / f"{name}.step"
    assembly.export(str(path))
    text = path.read_text()
    text = re.sub(r"'\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d'", "'2026-01-01T00:00:00'", text)
    path.write_text(text)


if __name__ == "__main__":
    write_stl(propeller(), "propeller")
    for make in (flange, bracket, bridge, torus, dome, pipe, boss, die, die_worn, branch):
        shape = make()
        solid = shape.val()
        assert solid.isValid() and len(shape.solids().vals()) == 1, make.__name__
        box = solid.BoundingBox()
        print(
            f"{make.__name__}: volume {solid.Volume():.3f} mm3, area {solid.Area():.3f} mm2,"
            f" box {box.xmin:.3f} {box.ymin:.3f} {box.zmin:.3f} .. {box.xmax:.3f} {box.ymax:.3f} {box.zmax:.3f},"
            f" faces {len(shape.faces().vals())}"
        )
        write(shape, make.__name__.replace("_", "-"))
