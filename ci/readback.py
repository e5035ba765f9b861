"""Reads what a run wrote with other software, and checks that the files agree with each other.

Usage: readback.py RUN_FOLDER    Exit code 1 when something does not hold. Installs nothing: ci/setup.sh does.
ParaView files by VTK's own readers, CSV by pandas, Parquet by pyarrow, STL by meshio and VTK.
"""

import json
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

import meshio
import numpy as np
import pandas as pd
import pyarrow.parquet
import vtk
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


def check_json(folder):
    for name, schema in (("verdict.json", "meltpath-verdict/"), ("provenance.json", "meltpath-provenance/")):
        path = folder / name
        if path.is_file():
            data = json.loads(path.read_text(encoding="utf-8"))
            expect(str(data.get("schema", "")).startswith(schema), f"{path}: schema {data.get('schema')!r}")


def main(arguments):
    if len(arguments) != 1:
        print(__doc__)
        return 2
    folder = pathlib.Path(arguments[0])
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
    check_json(folder)
    for problem in problems:
        print(f"FAILED {problem}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
