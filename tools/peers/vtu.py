#!/usr/bin/env python3
"""Writes fixtures/vtu: one grid in the forms that meshio and VTK (so ParaView) write.

  .local/venv-peers/bin/python tools/peers/vtu.py        (pip install meshio vtk)
"""

import pathlib

import meshio
import numpy
import vtk

OUT = pathlib.Path(__file__).resolve().parent.parent.parent / "fixtures/vtu"


def main():
    OUT.mkdir(exist_ok=True)
    at = lambda i, j, k: i + 4 * (j + 3 * k)
    points = [(i / 3, 0.1 * j, 0.7 * k) for k in range(2) for j in range(3) for i in range(4)]
    quad = lambda i, j, k: [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)]
    solids = [quad(i, j, 0) + quad(i, j, 1) for j in range(2) for i in range(3)]
    faces = [quad(0, 0, 0), quad(1, 0, 0)]
    heat = numpy.array([k * k / 7 for k in range(24)])
    part = numpy.arange(-3, 5, dtype=numpy.int32)
    mesh = meshio.Mesh(points, [("hexahedron", solids), ("quad", faces)], {"heat": heat}, {"part": [part[:6], part[6:]]})
    mesh.write(OUT / "meshio.vtu")

    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(OUT / "meshio.vtu"))
    reader.Update()
    forms = {
        "ascii": ["SetDataModeToAscii"],
        "inline": ["SetDataModeToBinary"],
        "big-endian": ["SetDataModeToBinary", "SetCompressorTypeToNone", "SetByteOrderToBigEndian"],
        "appended": ["SetDataModeToAppended", "EncodeAppendedDataOff", "SetHeaderTypeToUInt64"],
        "appended-base64": ["SetDataModeToAppended", "EncodeAppendedDataOn", "SetCompressorTypeToNone"],
    }
    for name, settings in forms.items():
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetFileName(str(OUT / (name + ".vtu")))
        writer.SetInputData(reader.GetOutput())
        writer.SetBlockSize(256)
        for setting in settings:
            getattr(writer, setting)()
        if not writer.Write():
            raise SystemExit(f"vtk cannot write {name}")


if __name__ == "__main__":
    main()
