#!/usr/bin/env python3
"""STEP files of the die sets of two guide pages, docs/guide/pan.md and docs/guide/u-channel.md.

  tools/peers/guide_parts.py [FOLDER]   default: fixtures; needs CadQuery (tools/peers/cad.py installs it)

Writes FOLDER/pan and FOLDER/u-channel: die.stp, punch.stp and holder.stp, one closed solid in millimetres each. The die
looks up and its flange is the plane z = 0. Punch and holder look down and stand open on the sheet.
"""

import math
import pathlib
import re
import sys
import tempfile

import cadquery as cq
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_Controller, STEPControl_StepModelType, STEPControl_Writer

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent

# Pan of 1 mm sheet: opening and depth of the die [mm], radius of its corners in plan, draft of its wall [deg], radii of
# the punch and of the die, clearance between their walls.
PAN = {"size": (200.0, 150.0), "depth": 30.0, "corner": 40.0, "draft": 8.0, "punch": 15.0, "die": 15.0}
PAN_SHEET, PAN_CLEARANCE, PAN_BLOCK = 1.0, 1.1, (320.0, 270.0)

# U-channel of 1.2 mm sheet: width of the punch, depth of the die, length, radii, clearance, width of the tools [mm].
U = {"width": 80.0, "depth": 60.0, "length": 120.0, "punch": 6.0, "die": 6.0}
U_SHEET, U_CLEARANCE, U_BLOCK = 1.2, 1.32, 260.0


def block(size, low, high):
    return cq.Workplane("XY").box(*size, high - low, centered=(True, True, False)).translate((0, 0, low))


def rounded(inset, height, taper=0.0):
    """A block over the opening of the pan from z = 0, its plan moved inwards by `inset`."""
    sketch = cq.Sketch().rect(*(side - 2 * inset for side in PAN["size"])).vertices().fillet(PAN["corner"] - inset)
    return cq.Workplane("XY").placeSketch(sketch).extrude(height, taper=taper)


def pan():
    size, depth, slope = PAN["size"], PAN["depth"], math.radians(PAN["draft"])
    bottom = PAN["punch"] + PAN_SHEET
    die = block(PAN_BLOCK, -depth - 40, 0)
    die = die.cut(rounded(0.0, -depth, PAN["draft"]).faces("<Z").edges().fillet(bottom))
    reach = [side / 2 + 5 for side in size]
    die = die.edges(between((-reach[0], -reach[1], -1), (*reach, 1))).fillet(PAN["die"])
    # Closed on the sheet the punch stands one thickness above the die, which widens the gap at the drafted wall.
    inset = (PAN_CLEARANCE - PAN_SHEET * math.sin(slope)) / math.cos(slope)
    punch = rounded(inset, -depth, PAN["draft"]).faces("<Z").edges().fillet(PAN["punch"])
    punch = punch.union(rounded(inset, 30.0)).translate((0, 0, depth + PAN_SHEET))
    holder = block(PAN_BLOCK, PAN_SHEET, PAN_SHEET + 30).cut(rounded(-2.0, 60.0))
    return {"die": die, "punch": punch, "holder": holder}


def u_channel():
    half, length, high = U["width"] / 2, U["length"], U["depth"] + U_SHEET + 20
    frame = length + 40
    die = block((U_BLOCK, frame), -U["depth"] - 40, 0)
    die = die.cut(block((2 * (half + U_CLEARANCE), frame + 2), -U["depth"], 1))
    die = die.edges(between((-half - 3, -frame, -1), (half + 3, frame, 1))).edges("|Y").fillet(U["die"])
    punch = block((2 * half, length), U_SHEET, high).faces("<Z").edges("|Y").fillet(U["punch"])
    holder = block((U_BLOCK, frame), U_SHEET, U_SHEET + 30)
    return {"die": die, "punch": punch, "holder": holder.cut(block((2 * half + 4, length + 10), 0, 99))}


def between(low, high):
    return cq.selectors.BoxSelector(low, high, boundingbox=True)


def write(shape, path, name):
    """AP214 with a header that does not depend on time, place and version."""
    STEPControl_Controller.Init_s()
    Interface_Static.SetCVal_s("write.step.schema", "AP214IS")
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)
    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    with tempfile.TemporaryDirectory() as folder:
        made = pathlib.Path(folder) / "made.stp"
        if writer.Write(str(made)) != IFSelect_ReturnStatus.IFSelect_RetDone:
            raise SystemExit(f"{path}: not written")
        text = made.read_text()
    header = f"FILE_NAME('{path.name}','',(''),(''),'','','');"
    text = re.sub(r"FILE_NAME\(.*?\);", header, text, count=1, flags=re.S)
    text = re.sub(r"FILE_DESCRIPTION\(.*?\);", f"FILE_DESCRIPTION(('{name}'),'2;1');", text, count=1, flags=re.S)
    text = re.sub(r"PRODUCT\('.*?','.*?',", f"PRODUCT('{name}','{name}',", text, count=1, flags=re.S)
    path.write_text(text)
    print(path, len(text), "bytes")


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "fixtures"
    for case, tools in (("pan", pan()), ("u-channel", u_channel())):
        (folder / case).mkdir(parents=True, exist_ok=True)
        for name, tool in tools.items():
            shape = tool.val()
            if not shape.isValid() or len(tool.solids().vals()) != 1:
                raise SystemExit(f"{case} {name}: not one valid solid")
            write(tool.solids().val().wrapped, folder / case / f"{name}.stp", name)
