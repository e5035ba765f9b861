"""Writes the example parts of this folder as STEP files with OpenCASCADE (through CadQuery).

Run `python make_parts.py` here with `pip install cadquery`; meltpath itself needs neither.
All lengths are millimetres. The dates in the files are fixed, so that a second run writes the
same bytes.
"""

import re
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


def write(shape: cq.Workplane, name: str) -> None:
    """Writes one named part, with the time stamp and the running number of the writer removed."""
    assembly = cq.Assembly(shape, name=name)
    path = HERE / f"{name}.step"
    assembly.export(str(path))
    text = path.read_text()
    text = re.sub(r"'\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d'", "'2026-01-01T00:00:00'", text)
    path.write_text(text)


if __name__ == "__main__":
    for make in (flange, bracket, bridge, torus, dome):
        shape = make()
        solid = shape.val()
        assert solid.isValid() and len(shape.solids().vals()) == 1, make.__name__
        box = solid.BoundingBox()
        print(
            f"{make.__name__}: volume {solid.Volume():.3f} mm3, area {solid.Area():.3f} mm2,"
            f" box {box.xmin:.3f} {box.ymin:.3f} {box.zmin:.3f} .. {box.xmax:.3f} {box.ymax:.3f} {box.zmax:.3f},"
            f" faces {len(shape.faces().vals())}"
        )
        write(shape, make.__name__)
