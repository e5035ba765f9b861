"""Reads what a run wrote with other software, and checks that the files agree with each other.

Usage: readback.py RUN_FOLDER [RUN_FOLDER …]    Exit code 1 when something does not hold. Installs nothing: ci/setup.sh does.
ParaView files by VTK's own readers, CSV by pandas, Parquet by pyarrow, STL by meshio and VTK, 3MF toolpaths by xmlschema against the 3MF Consortium's
schemas (ci/schema).
"""

import json
import pathlib
import sys
import xml.etree.ElementTree as ElementTree
import zipfile

import meshio
import numpy as np
import pandas as pd
import pyarrow.parquet
import vtk
import xmlschema
from vtk.util.numpy_support import vtk_to_numpy

READERS = {".vtp": vtk.vtkXMLPolyDataReader, ".vti": vtk.vtkXMLImageDataReader, ".vtu": vtk.vtkXMLUnstructuredGridReader}
problems = []


def expect(holds, what):
    if not holds:
        problems.append(what)


def arrays(attributes):
    return {attributes.GetArrayName(i): vtk_to_numpy(attributes.GetArray(i)) for i in range(attributes.GetNumberOfArrays())}


def read_vtk(path):
    """The data set and what VTK says while reading it."""
    errors = []
    reader = READERS[path.suffix]()
    reader.AddObserver("ErrorEvent", lambda *_: errors.append("VTK reports an error"))
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    expect(not errors, f"{path}: VTK refuses it")
    expect(data.GetNumberOfPoints() > 0, f"{path}: no points")
    return data


def check_vtk(path):
    data = read_vtk(path)
    box = np.array(data.GetBounds())
    expect(np.isfinite(box).all() and np.abs(box).max() < 1e5, f"{path}: bounds {box}")
    for name, values in {**arrays(data.GetPointData()), **arrays(data.GetCellData())}.items():
        expect(len(values) > 0, f"{path}: {name} is empty")
        expect(not np.isinf(values.astype(float)).any(), f"{path}: {name} holds infinite values")
        expect(np.isfinite(values.astype(float)).any(), f"{path}: {name} holds no value")
    if path.suffix == ".vtp":
        points = data.GetNumberOfPoints()
        cells = [data.GetCell(i) for i in (0, data.GetNumberOfCells() - 1)]
        ids = [c.GetPointId(c.GetNumberOfPoints() - 1) for c in cells]
        expect(max(ids) < points, f"{path}: a cell refers to point {max(ids)} of {points}")
        if data.GetNumberOfLines():
            expect(ids[1] == points - 1, f"{path}: the last line ends at point {ids[1]} of {points}")
    if path.suffix == ".vti":
        check_volume(path, data)
    print(f"  {path.name}: {data.GetNumberOfPoints()} points, {data.GetNumberOfCells()} cells")
    return data


def check_volume(path, data):
    """A volume of voxels: as many values as cells, classes in the order of temperatures."""
    cells = arrays(data.GetCellData())
    heat, classes = cells.get("highest_temperature_C"), cells.get("class")
    if heat is None or classes is None:
        return
    expect(len(heat) == len(classes) == data.GetNumberOfCells(), f"{path}: other counts than its {data.GetNumberOfCells()} cells")
    found = sorted(set(classes.tolist()))
    expect(set(found) <= {0, 1, 2, 3}, f"{path}: classes {found}")
    for low, high in zip(found, found[1:]):
        expect(heat[classes == low].max() <= heat[classes == high].min(), f"{path}: class {high} is colder than {low}")
    print(f"  {path.name}: {len(heat)} voxels, up to {heat.max():.0f} °C, classes {found}")


def check_collection(path):
    entries = ElementTree.parse(path).getroot().findall(".//DataSet")
    steps = [float(e.get("timestep")) for e in entries]
    expect(entries and steps == sorted(set(steps)), f"{path}: steps are not ascending: {steps[:5]}")
    previous = None
    for entry in entries:
        target = path.parent / entry.get("file")
        expect(target.is_file(), f"{path}: {entry.get('file')} is not there")
        if not target.is_file():
            continue
        data = read_vtk(target)
        height = next((v for n, v in arrays(data.GetPointData()).items() if n.startswith("height [")), None)
        if height is not None and previous is not None:
            expect(len(height) == len(previous), f"{target}: another grid than the layer before")
            # a layer adds metal; remelting may sink the surface, but never the whole build
            expect(np.nansum(height) >= np.nansum(previous), f"{target}: less metal than the layer before")
        previous = height
    print(f"  {path.name}: {len(entries)} steps")


def check_tables(folder):
    for path in sorted(folder.rglob("*.csv")):
        table = pd.read_csv(path)
        expect(len(table) > 0, f"{path}: no rows")
        expect(not np.isinf(table.select_dtypes("number").to_numpy(dtype=float)).any(), f"{path}: infinite values")
        times = next((c for c in table.columns if c.startswith("time [")), None)
        if times:
            expect(table[times].is_monotonic_increasing, f"{path}: time goes back")
        print(f"  {path.name}: {len(table)} rows, columns {', '.join(table.columns)}")
    for path in sorted(folder.rglob("*.parquet")):
        table = pyarrow.parquet.read_table(path).to_pandas()
        expect(len(table) > 0, f"{path}: no rows")
        print(f"  {path.name}: {len(table)} rows, columns {', '.join(table.columns)}")
        twin = path.with_suffix(".csv")
        if twin.is_file():
            other = pd.read_csv(twin)
            expect(list(other.columns) == list(table.columns), f"{path}: other columns than {twin.name}")
            expect(len(other) == len(table), f"{path}: {len(table)} rows, {twin.name} has {len(other)}")
            for name in table.select_dtypes("number"):
                same = np.array_equal(other[name].to_numpy(float), table[name].to_numpy(float), equal_nan=True)
                expect(same, f"{path}: {name} differs from {twin.name}")


def check_stl(path):
    mesh = meshio.read(path)
    triangles = mesh.cells_dict.get("triangle", np.empty((0, 3)))
    expect(len(triangles) > 0 and np.isfinite(mesh.points).all(), f"{path}: no triangles, or points that are not finite")
    reader = vtk.vtkSTLReader()
    reader.SetFileName(str(path))
    reader.Update()
    expect(reader.GetOutput().GetNumberOfPolys() == len(triangles), f"{path}: VTK and meshio count other triangles")
    mass = vtk.vtkMassProperties()
    mass.SetInputConnection(reader.GetOutputPort())
    mass.Update()
    expect(mass.GetVolume() > 0, f"{path}: encloses no volume")
    print(f"  {path.name}: {len(triangles)} triangles, {mass.GetVolume() / 1000:.3f} cm3")


SCHEMAS = pathlib.Path(__file__).resolve().parent / "schema" / "3mf-toolpath"
TOOLPATH = "http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03"
CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"


def schema(name):
    return xmlschema.XMLSchema(str(SCHEMAS / name), allow="local")


def expect_valid(schema, element, what):
    errors = list(schema.iter_errors(element))
    expect(not errors, f"{what}: not valid: {[e.reason for e in errors[:3]]}")


def linked(package, part):
    """The targets of what a part of a package says of others, by relationship type."""
    folder, _, name = part.rpartition("/")
    text = package.read(f"{folder}/_rels/{name}.rels".lstrip("/"))
    return {e.get("Target"): e.get("Type") for e in ElementTree.fromstring(text)}


def check_toolpath(path):
    """A 3MF toolpath: valid by its schemas, every reference resolves, and the beads are as long as the table of the plan says."""
    package = zipfile.ZipFile(path)
    expect(package.testzip() is None, f"{path}: damaged")
    kinds = {e.get("Extension") for e in ElementTree.fromstring(package.read("[Content_Types].xml"))}
    expect({name.rsplit(".", 1)[-1] for name in package.namelist()} <= kinds, f"{path}: parts without a content type")
    (start,) = linked(package, "")
    model = ElementTree.fromstring(package.read(start.lstrip("/")))
    expect(set(model.get("requiredextensions").split()) == {"p", "tp"}, f"{path}: requires {model.get('requiredextensions')}")
    build = model.find(f"{{{CORE}}}build")
    resource = model.find(f".//{{{TOOLPATH}}}toolpathresource[@id='{build.get(f'{{{TOOLPATH}}}toolpathid')}']")
    whole, of_layer = schema("toolpath_2026_03.xsd"), schema("toolpath_layer_2026_03.xsd")
    expect_valid(whole, resource, f"{path}: {start}")
    items = {e.get(f"{{{PRODUCTION}}}UUID") for e in build}
    profiles = {e.get("uuid") for e in resource.iter(f"{{{TOOLPATH}}}toolpathprofile")}
    objects = [e for e in model.iter(f"{{{CORE}}}object") if e.get("id") in {i.get("objectid") for i in build}]
    expect(len(objects) == len(items) > 0, f"{path}: builds nothing")
    relations, unit = linked(package, start.lstrip("/")), float(resource.get("unitfactor"))
    lengths, lines = [], 0
    for layer in resource.iter(f"{{{TOOLPATH}}}toolpathlayer"):
        name = layer.get("path")
        expect(relations.get(name) == f"{TOOLPATH}/layer", f"{path}: no relationship leads to {name}")
        data = ElementTree.fromstring(package.read(name.lstrip("/")))
        for one in (whole, of_layer):
            expect_valid(one, data, f"{path}: {name}")
        expect({e.get("uuid") for e in data.iter(f"{{{TOOLPATH}}}part")} <= items, f"{path}: {name} names a part that is not built")
        expect({e.get("uuid") for e in data.iter(f"{{{TOOLPATH}}}profile")} <= profiles, f"{path}: {name} names an unknown profile")
        for segment in data.iter(f"{{{TOOLPATH}}}segment"):
            points = np.array([[float(e.get(k)) for k in "xyz"] for e in segment.iter(f"{{{TOOLPATH}}}point6d")])
            lines += max(len(segment) - 1, 0)
            if len(points):
                turns = np.array([[float(e.get(k)) for k in "ijkw"] for e in segment])
                expect(np.abs((turns**2).sum(axis=1) - 1).max() < 1e-6, f"{path}: {name}: quaternions that are not of unit length")
                lengths.append(unit * np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    table = path.parent / "series" / "passes.csv"
    if lengths and table.is_file():
        plan = pd.read_csv(table)
        laid = plan.length_mm[plan.role.isin(["contour", "fill", "skin", "support"])].to_numpy()
        same = len(laid) == len(lengths) and np.allclose(laid, lengths, rtol=1e-3, atol=2e-3)
        expect(same, f"{path}: {len(lengths)} beads of {sum(lengths):.3f} mm, the plan has {len(laid)} of {laid.sum():.3f} mm")
    print(f"  {path.name}: {resource.get('toolpathtype')}, {lines} lines, {len(lengths)} beads of {sum(lengths) / 1000:.3f} m, valid")


def check_json(folder):
    for name, schema in (("verdict.json", "meltpath-verdict/"), ("provenance.json", "meltpath-provenance/")):
        path = folder / name
        if path.is_file():
            data = json.loads(path.read_text(encoding="utf-8"))
            expect(str(data.get("schema", "")).startswith(schema), f"{path}: schema {data.get('schema')!r}")


def check(folder):
    print(folder)
    files = sorted(p for p in folder.rglob("*") if p.suffix in READERS)
    tables = [*folder.rglob("*.csv"), *folder.rglob("*.parquet")]
    histories = sorted(folder.rglob("*.jsonl"))
    expect(files or tables or histories, f"{folder}: neither ParaView files nor tables nor histories")
    for path in files:
        check_vtk(path)
    for path in sorted(folder.rglob("*.pvd")):
        check_collection(path)
    check_tables(folder)
    for path in histories:
        expect(len(pd.read_json(path, lines=True)) > 0, f"{path}: no tests")
    for path in sorted(folder.rglob("*.stl")):
        check_stl(path)
    for path in sorted(folder.rglob("*.build.3mf")):
        check_toolpath(path)
    check_json(folder)


def main(arguments):
    if not arguments:
        print(__doc__)
        return 2
    for folder in arguments:
        check(pathlib.Path(folder))
    for problem in problems:
        print(f"FAILED {problem}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
