"""Solid dies of `tools/peers/dies.py`: each function returns a list of bodies (name, shape, colour). Lengths in mm."""

import math

import cadquery as cq
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Sewing
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.gp import gp_Pln
from OCP.ShapeFix import ShapeFix_Face

GREY, GREEN, ORANGE = (0.55, 0.57, 0.6), (0.2, 0.6, 0.3), (0.9, 0.5, 0.1)


def frustum(sketch, depth, draft, z=0.0, at=(0, 0), turn=0.0):
    """A sketch at height z extruded by a depth (down where negative), its walls drawn in by a draft angle [degrees]."""
    solid = cq.Workplane("XY").placeSketch(sketch).extrude(depth, taper=draft)
    return solid.rotate((0, 0, 0), (0, 0, 1), turn).translate((*at, z))


def rounded(width, length, radius):
    return cq.Sketch().rect(width, length).vertices().fillet(radius)


def block(width, length, low, high, corner=0.0):
    solid = cq.Workplane("XY").box(width, length, high - low).translate((0, 0, (low + high) / 2))
    return solid.edges("|Z").fillet(corner) if corner else solid


def level(solid, z, half=(1e4, 1e4), centre=(0, 0)):
    """Edges at a height within a rectangle."""
    corners = [(centre[0] + s * half[0], centre[1] + s * half[1], z + s * 0.01) for s in (-1, 1)]
    return solid.edges(cq.selectors.BoxSelector(*corners, boundingbox=True))


def tapered_fillet(solid, edges, axis):
    """Fillets of edges (edge, first, last): the radius changes from `first` at the lower end along an axis to `last`."""
    maker = BRepFilletAPI_MakeFillet(solid.val().wrapped)
    for edge, first, last in edges:
        rises = getattr(edge.endPoint(), axis) > getattr(edge.startPoint(), axis)
        forward = rises == (edge.wrapped.Orientation().name != "TopAbs_REVERSED")  # of the edge without its orientation
        maker.Add(*((first, last) if forward else (last, first)), edge.wrapped)
    return cq.Workplane(cq.Shape.cast(maker.Shape()))


def pan():
    """Pan 300 x 200 x 55, draft 10 degrees; radii of the wall corners from 40 (mouth) to 24 (floor), mouth 8, floor 10."""
    die = block(420, 320, -95, 0).cut(frustum(cq.Sketch().rect(300, 200), -55, 10))
    inside = cq.selectors.BoxSelector((-155, -105, -56), (155, 105, 1), boundingbox=True)
    walls = [e for e in die.edges(inside).vals() if abs(e.startPoint().z - e.endPoint().z) > 50]
    die = tapered_fillet(die, [(e, 24, 40) for e in walls], "z")
    die = level(die, 0, (151, 101)).fillet(8)
    die = level(die, -55, (151, 101)).fillet(10)
    return [("pan", die.val(), GREY)]


def cell(kind, number):
    """One embossment on a plane: its faces, and the wire of the opening in the plane z = 0."""
    radius, turn = 4 + number % 5 * 0.75, (number * 37 % 7 - 3) * 4.0
    depth, up = 11 + number % 4 * 1.5, kind in ("boss", "rib")
    if kind in ("pocket", "boss"):
        sketch = rounded(62 + number % 3 * 4, 50 + number % 4 * 3, 13 + number % 5)
    elif kind in ("bead", "rib"):
        sketch = cq.Sketch().slot(40 + number % 3 * 4, 30)
    else:
        sketch = cq.Sketch().circle(24 + number % 4)
    base, tool = block(200, 200, -60, 0), frustum(sketch, depth if up else -depth, 12 + number % 3, 0, (0, 0), turn)
    solid = base.union(tool) if up else base.cut(tool)
    solid = level(solid, 0, (60, 60)).fillet(radius)
    solid = level(solid, depth if up else -depth, (60, 60)).fillet(radius + 1)
    inside = [f for f in solid.faces().vals() if f.BoundingBox().xmax < 60 and f.BoundingBox().xmin > -60]
    return inside, next(f for f in solid.faces("|Z").vals() if abs(f.Center().z) < 1e-6 and f.innerWires()).innerWires()[0]


def panel(columns, rows, pitch=(100, 90)):
    """Plate with a grid of embossments: drafted pockets and bosses with rounded corners, beads and ribs, dimples; every
    edge of them rounded by 4 to 8. The edge of the plate is rounded by 8, its corners by 25."""
    width, length = columns * pitch[0] + 20, rows * pitch[1] + 20
    plate = block(width, length, -60, 0, 25)
    plate = level(plate, 0).fillet(8).val()
    top = next(f for f in plate.Faces() if abs(f.Center().z) < 1e-6)
    sewing, openings = BRepBuilderAPI_Sewing(1e-6), []
    for face in plate.Faces():
        if not face.isSame(top):
            sewing.Add(face.wrapped)
    for number in range(columns * rows):
        kind = ("pocket", "dimple", "boss", "dimple", "bead", "rib")[number % 6]
        faces, wire = cell(kind, number)
        i, j = number % columns, number // columns
        at = cq.Vector((i - columns / 2 + 0.5) * pitch[0], (j - rows / 2 + 0.5) * pitch[1], 0)
        moved = moved_copy(cq.Compound.makeCompound([*faces, wire]), at)
        for face in moved.Faces():
            sewing.Add(face.wrapped)
        openings.append(next(s for s in moved if s.ShapeType() == "Wire"))
    maker = BRepBuilderAPI_MakeFace(gp_Pln(BRep_Tool.Surface_s(top.wrapped).Position()), top.outerWire().wrapped)
    for wire in openings:
        maker.Add(wire.wrapped)
    fix = ShapeFix_Face(maker.Face())
    fix.FixOrientation()
    sewing.Add(fix.Face())
    sewing.Perform()
    solid = cq.Solid.makeSolid(cq.Shape.cast(sewing.SewedShape()))
    return [("panel", solid, GREY)]


def moved_copy(shape, at):
    return shape.copy().translate(at)


def cup(closed):
    """Tools of a square cup of 0.8 mm sheet, drawn along -z by 25 mm.

    Punch: 100 x 100 at its nose with plan corners of 24 (both before the nose is rounded), draft 8 degrees (wider upwards),
    nose radius 8, 85 high. Die: the punch's surface offset by 0.8 (floor radius 8.8), 25.8 deep, face at z = 0, 220 x 220 with
    corners of 20, die radius 6, bottom at -75. Binder: 220 x 220 x 30, its face at z = 0.8, radius 3 at the mouth of its
    opening, which leaves the punch 1.87 all round when the tools are closed. Open: the punch's nose at z = 0.8 touches the flat
    sheet, which lies on the die from 0 to 0.8. Closed: the punch is 25.8 lower (nose at z = -25): the gap is 0.8 mm along the
    normal between nose and floor, their fillets, and the walls up to the die radius. No face is undercut along z."""
    sheet, draft, depth, size, corner = 0.8, 8.0, 25.0, 100.0, 24.0
    slope, height = math.tan(math.radians(draft)), 85.0
    wider = lambda z: 2 * z * slope  # of the punch at a height over its nose
    # The corner of a tapered sketch is a cone: its radius grows with the height as the half width does.
    nose = lambda z: rounded(size + wider(z), size + wider(z), corner + wider(z) / 2)
    punch = frustum(nose(height), -height, draft, height)
    punch = level(punch, 0).fillet(8)
    away = sheet / math.cos(math.radians(draft))
    mouth = rounded(size + wider(depth) + 2 * away, size + wider(depth) + 2 * away, corner + wider(depth) / 2 + away)
    die = block(220, 220, -75, 0, 20).cut(frustum(mouth, -depth - sheet, draft))
    die = level(die, 0, (80, 80)).fillet(6)
    die = level(die, -depth - sheet, (80, 80)).fillet(8 + sheet)
    opening = size + wider(30 + depth) + 4
    hole = frustum(rounded(opening, opening, corner + wider(30 + depth) / 2 + 2), 40, 0)
    binder = block(220, 220, sheet, sheet + 30, 20).cut(hole)
    binder = level(binder, sheet, (80, 80)).fillet(3)
    punch = punch.translate((0, 0, -depth if closed else sheet))
    return [("die", die.val(), GREY), ("binder", binder.val(), GREEN), ("punch", punch.val(), ORANGE)]
