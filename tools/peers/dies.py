#!/usr/bin/env python3
"""Forming-die shapes to test reading, conversion and audit on, made with Open CASCADE (`pip install cadquery`).

  tools/peers/dies.py FOLDER [NAME...]

Writes each shape as NAME.stp (AP214), NAME_143.igs (bounded surfaces), NAME_144.igs (trimmed surfaces) and, of solids,
NAME_186.igs; the same with _car in its name in car-line coordinates (3.1 m from the origin, tilted about all axes), and
NAME_inch.stp and NAME_inch_144.igs in inches. FOLDER/dies.json holds what is true of them: faces, area, box, bodies and
their names, from the kernel's own model. It is updated after each shape; shapes of other names in it are kept.
"""

import json
import pathlib
import sys
import tempfile
import time

import cadquery as cq
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Builder
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert, BRepBuilderAPI_Transform
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.IGESCAFControl import IGESCAFControl_Writer
from OCP.IGESControl import IGESControl_Controller
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

import dies_parts
import dies_skins
import dies_solids
import iges143

SHAPES = {
    "panel_100": lambda: dies_solids.panel(3, 2), "panel_330": lambda: dies_solids.panel(7, 3),
    "panel_1000": lambda: dies_solids.panel(10, 7), "panel_1500": lambda: dies_solids.panel(15, 7),
    "pan": dies_solids.pan,
    "beaded_skin": dies_skins.beaded_skin, "door": dies_parts.door, "bracket": dies_parts.bracket,
    "b_pillar": dies_parts.b_pillar, "offset_skin": dies_skins.offset_skin, "swept_skin": dies_skins.swept_skin,
    "die_binder_punch": lambda: dies_solids.cup(False), "die_binder_punch_closed": lambda: dies_solids.cup(True),
}
CAR_TURNS = (((0, 0, 1), 23.7), ((0, 1, 0), 11.3), ((1, 0, 0), -7.9))  # axis, degrees; one after the other
CAR_SHIFT = (2875.4, -743.2, 1022.6)  # mm
ACCURACY = 1e-10  # of areas, relative; the kernel's adaptive integration


def only_solid(shape):
    """The solid of a compound of one solid, as the kernel's fillets return it; any other shape as it is."""
    solids = shape.Solids()
    return solids[0] if len(solids) == 1 else shape


def car():
    place = gp_Trsf()
    for axis, degrees in CAR_TURNS:
        turn = gp_Trsf()
        turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(*axis)), degrees * 3.141592653589793 / 180)
        place = turn * place
    shift = gp_Trsf()
    shift.SetTranslation(gp_Vec(*CAR_SHIFT))
    return shift * place


def matrix(place):
    return [[place.Value(row, column) for column in range(1, 5)] for row in range(1, 4)]


def placed(bodies, place):
    return [(name, cq.Shape.cast(BRepBuilderAPI_Transform(shape.wrapped, place, True).Shape()), colour)
            for name, shape, colour in bodies]


def document(bodies):
    made = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(made.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(made.Main())
    for name, shape, colour in bodies:
        label = shapes.AddShape(shape.wrapped, False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
        colour = Quantity_Color(*colour, Quantity_TypeOfColor.Quantity_TOC_sRGB)
        colours.SetColor(label, colour, XCAFDoc_ColorType.XCAFDoc_ColorGen)
    return made


def write_step(path, bodies, unit="MM"):
    writer = STEPCAFControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(document(bodies))
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.step.unit", "MM")


def write_iges(path, bodies, solids, unit="MM"):
    IGESControl_Controller.Init_s()
    Interface_Static.SetCVal_s("write.iges.unit", unit)
    Interface_Static.SetIVal_s("write.iges.brep.mode", int(solids))
    writer = IGESCAFControl_Writer()
    writer.Transfer(document(bodies))
    writer.ComputeModel()
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.iges.unit", "MM")


def bounded(bodies):
    """Copies of bodies whose faces do not say that they are the whole of their surface: the writer would leave out the outer
    boundaries of such faces, which a 144 may and a 143 may not."""
    copies = placed(bodies, gp_Trsf())
    for _, shape, _ in copies:
        for face in shape.Faces():
            BRep_Builder().NaturalRestriction(face.wrapped, False)
    return copies


def area(shape):
    """Adaptive integral. Surfaces of extrusion and revolution are converted to B-splines first, which is exact: the kernel
    does not divide them at the knots of their profiles, and is then wrong by up to 2e-4 with a reported error of 0."""
    total = 0.0
    for face in shape.Faces():
        found, face_ = GProp_GProps(), face.wrapped
        if face.geomType() in ("EXTRUSION", "REVOLUTION"):
            face_ = BRepBuilderAPI_NurbsConvert(face_, True).Shape()
        BRepGProp.SurfaceProperties_s(face_, found, ACCURACY)
        total += found.Mass()
    return total


def volume(solid):
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid.wrapped, found, 10 * ACCURACY, True)
    return found.Mass()


def box(shapes):
    """Their box, which the kernel may widen by its tolerance of 1e-7 mm."""
    found = Bnd_Box()
    for shape in shapes:
        BRepBndLib.AddOptimal_s(shape.wrapped, found, False, False)
    low, high = found.CornerMin(), found.CornerMax()
    return [low.X(), low.Y(), low.Z(), high.X(), high.Y(), high.Z()]


def truth(bodies, in_car):
    rows = []
    for (name, shape, _), (_, there, _) in zip(bodies, in_car):
        kinds = {}
        for face in shape.Faces():
            kinds[face.geomType()] = kinds.get(face.geomType(), 0) + 1
        solid = shape.ShapeType() == "Solid"
        rows.append({"name": name, "faces": len(shape.Faces()), "faces_by_type": kinds, "area_mm2": area(shape),
                     "volume_mm3": volume(shape) if solid else None, "solid": solid,
                     "valid": BRepCheck_Analyzer(shape.wrapped).IsValid(), "box_mm": box([shape]), "box_car_mm": box([there])})
    return {"faces": sum(r["faces"] for r in rows), "area_mm2": sum(r["area_mm2"] for r in rows), "bodies": len(rows),
            "names": [r["name"] for r in rows], "valid": all(r["valid"] for r in rows), "body": rows,
            "box_mm": box([b[1] for b in bodies]), "box_car_mm": box([b[1] for b in in_car])}


def write(folder, name, bodies, in_car):
    files = []

    def path(suffix):
        files.append(f"{name}{suffix}")
        return folder / files[-1]

    for mark, placed_bodies in (("", bodies), ("_car", in_car)):
        write_step(path(f"{mark}.stp"), placed_bodies)
        write_iges(path(f"{mark}_144.igs"), placed_bodies, False)
        with tempfile.TemporaryDirectory() as other:  # of the same faces, each with its outer boundary written
            trimmed = pathlib.Path(other) / "trimmed.igs"
            write_iges(trimmed, bounded(placed_bodies), False)
            iges143.rewrite(trimmed, path(f"{mark}_143.igs"))
        if all(shape.ShapeType() == "Solid" for _, shape, _ in bodies):
            write_iges(path(f"{mark}_186.igs"), placed_bodies, True)
    write_step(path("_inch.stp"), bodies, "INCH")
    write_iges(path("_inch_144.igs"), bodies, False, "INCH")
    return files


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    folder, names = pathlib.Path(sys.argv[1]), sys.argv[2:] or list(SHAPES)
    unknown = [name for name in names if name not in SHAPES]
    if unknown:
        sys.exit(f"tools/peers/dies.py: no shape {unknown[0]}; allowed: {', '.join(SHAPES)}")
    folder.mkdir(parents=True, exist_ok=True)
    Message.DefaultMessenger_s().ChangePrinters().Clear()  # it talks on standard output
    known = folder / "dies.json"
    for name in names:
        start = time.perf_counter()
        bodies = [(body, only_solid(shape), colour) for body, shape, colour in SHAPES[name]()]
        in_car = placed(bodies, car())
        row = truth(bodies, in_car)
        made = time.perf_counter() - start
        with tempfile.TemporaryDirectory(dir=folder) as other:  # readers never see half a file
            row["files"] = write(pathlib.Path(other), name, bodies, in_car)
            for file in row["files"]:
                (pathlib.Path(other) / file).replace(folder / file)
        all_ = json.loads(known.read_text()) if known.exists() else {"car_from_body": matrix(car()), "shapes": {}}
        all_["shapes"][name] = row
        known.write_text(json.dumps(all_, indent=1) + "\n")
        written = time.perf_counter() - start - made
        print(f"{name}: {row['faces']} faces, {row['bodies']} bodies, {row['area_mm2']:.6f} mm2, "
              f"{'valid' if row['valid'] else 'NOT VALID'}, made in {made:.1f} s, written in {written:.1f} s", flush=True)


if __name__ == "__main__":
    main()
