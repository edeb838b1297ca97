"""Dies of parts for `tools/peers/dies.py`: bracket, door and B-pillar. Lengths in mm."""

import cadquery as cq
from OCP.BRep import BRep_Tool
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections

from dies_skins import column, embossed, rim, spline_surface
from dies_solids import GREY, block, frustum, level, rounded, tapered_fillet


def bracket():
    """Die of an L-shaped bracket, block 360 x 300: cavity 28 deep, draft 7 degrees, corners 14, mouth 6, floor 5, with a deeper
    pocket; a closed draw bead of radius 6 (4 high) around it and two straight ones with ball ends, feet rounded by 3; four
    bores with rounded mouths."""
    corners = [(-110, -80), (110, -80), (110, -5), (5, -5), (5, 85), (-110, 85), (-110, -80)]
    outline = cq.Sketch().polygon(corners).vertices().fillet(14)
    die = block(360, 300, -90, 0, 15)
    die = die.cut(frustum(outline, -28, 7))
    die = level(die, 0, (115, 90)).fillet(6)
    die = level(die, -28, (115, 90)).fillet(5)
    die = die.cut(frustum(rounded(70, 44, 12), -60, 10, 14, (-50, 30), 9).intersect(block(400, 400, -46, 50)))
    die = level(die, -28, (50, 38), (-50, 30)).fillet(4)
    die = level(die, -46, (50, 38), (-50, 30)).fillet(5)
    path = cq.Workplane("XY").workplane(offset=-2).placeSketch(rounded(290, 232, 40)).extrude(1).faces("<Z").wires().val()
    ring = cq.Workplane("YZ", origin=(0, -116, -2)).circle(6)
    die = die.union(ring.sweep(cq.Workplane(path), transition="round"))
    feet = [e for e in level(die, 0, (160, 130)).vals() if abs(e.Center().x) > 120 or abs(e.Center().y) > 95]
    die = die.newObject(feet).fillet(3)
    for at in ((58, 45), (72, 75)):
        ball = cq.Workplane("XY").sphere(6)
        bead = cq.Workplane("YZ").circle(6).extrude(50).union(ball).union(ball.translate((50, 0, 0)))
        die = die.union(bead.translate((at[0] - 25, at[1], -2)))
        die = level(die, 0, (36, 9), at).fillet(3)
    for at in ((-165, -135), (165, -135), (-165, 135), (165, 135)):
        die = die.cut(frustum(cq.Sketch().circle(6), -200, 0, 50, at))
        die = level(die, 0, (7, 7), at).fillet(2)
    return [("bracket", die.val(), GREY)]


def door_height(x, y):
    return 95 - x * x / 14000 - (y + 60) * (y + 60) / 9000


def door():
    """Lower die of a door panel, block 1300 x 1150: a doubly curved pad about 60 high, draft 8 degrees, corners 60; window
    opening down to z = 15; handle recess, speaker recess in two steps, map pocket, a bead; edges rounded by 5 to 12."""
    surface = spline_surface(door_height, (700, 620))
    outline = [(-520, -430), (500, -430), (540, -150), (520, 60), (300, 430), (-380, 450), (-540, 120), (-520, -430)]
    pad = frustum(cq.Sketch().polygon(outline).vertices().fillet(60), 160, 8, -20).cut(column(surface, 0, 400))
    die = block(1300, 1150, -150, 0, 40).union(pad)
    die = level(die, 0, (600, 500)).fillet(12)
    die = rim(die, door_height, 0, (-590, -500, 590, 500)).fillet(10)
    window = [(-400, 130), (370, 110), (235, 345), (-310, 360), (-400, 130)]
    hole = frustum(cq.Sketch().polygon(window).vertices().fillet(45), -95, 12, 110)
    die = die.cut(hole)
    box = (-430, 80, 400, 400)
    die = rim(die, door_height, 0, box).fillet(10)
    die = level(die, 15, (420, 160), (-15, 235)).fillet(12)
    for sketch, at, turn, lift, radii in (
        (rounded(190, 90, 32), (-370, -10), 4, -18, (6, 8)), (rounded(420, 120, 40), (60, -330), -2, -16, (8, 6)),
        (cq.Sketch().circle(105), (-360, -270), 0, -14, (8, 6)), (cq.Sketch().slot(420, 60), (110, -60), 3, 13, (8, 5)),
        (cq.Sketch().slot(260, 56), (160, -175), -4, -12, (5, 6)),
    ):
        die = embossed(die, surface, door_height, sketch, at, turn, lift, 12, radii)
    return [("door", die.val(), GREY)]


def pillar_section(x):
    """Half width of the top, its height, half width at the foot, outer half width, and rise of the flange at a length."""
    t = x / 1200
    ends = 90 * max(0.0, t - 0.7) ** 2 / 0.09 + 40 * max(0.0, 0.2 - t) ** 2 / 0.04
    top, high = 46 + ends, 62 - 14 * t - 0.22 * ends
    return top, high, top + 0.22 * high + 4, top + 62, 70 * (t - 0.5) ** 2 * -4 + 10 * t


def pillar_top(x, _):
    _, high, _, _, rise = pillar_section(x)
    return rise + high


def b_pillar():
    """Lower die of a B-pillar, 1200 long: hat of changing width, height and rise lofted through 13 sections; shoulder radii
    from 12 to 7, foot radii from 6 to 10; two hinge seats, a bead, three recesses and two bores in its top."""
    loft = BRepOffsetAPI_ThruSections(True, False, 1e-6)
    for k in range(13):
        x = 100.0 * k
        top, high, foot, outer, rise = pillar_section(x)
        right = [(outer, -160), (outer + 6, rise), (foot, rise + 1.5), (top, rise + high)]
        loop = right + [(-y, z) for y, z in reversed(right)]
        loft.AddWire(cq.Wire.makePolygon([cq.Vector(x, y, z) for y, z in loop], close=True).wrapped)
    loft.Build()
    die = cq.Workplane(cq.Shape.cast(loft.Shape()))
    roof = max((f for f in die.faces().vals() if f.BoundingBox().xlen > 1000), key=lambda f: f.Center().z)
    surface = BRep_Tool.Surface_s(roof.wrapped)
    top, high, foot, _, rise = pillar_section(0)
    shoulder, foot = (long_edges(die, y, z) for y, z in ((top, rise + high), (foot, rise + 1.5)))
    die = tapered_fillet(die, [(e, 12, 7) for e in shoulder] + [(e, 6, 10) for e in foot], "x")
    for sketch, at, turn, lift, radii in (
        (rounded(90, 52, 15), (300, 0), 0, -11, (5, 5)), (rounded(90, 52, 15), (770, 0), 0, -11, (5, 5)),
        (cq.Sketch().slot(180, 44), (540, 0), 0, 10, (5, 4)), (cq.Sketch().circle(30), (1110, 46), 0, -12, (5, 6)),
        (cq.Sketch().circle(30), (1110, -46), 0, -12, (5, 6)), (rounded(64, 90, 18), (65, 0), 0, -12, (5, 6)),
    ):
        die = embossed(die, surface, pillar_top, sketch, at, turn, lift, 15, radii)
    for at in ((200, 0), (930, 0)):
        die = die.cut(frustum(cq.Sketch().circle(8), -400, 0, 150, at))
    return [("b_pillar", die.val(), GREY)]


def long_edges(solid, y, z):
    """Edges along the whole part whose ends at the smaller x lie at +-y and z."""
    first = lambda edge: min((edge.startPoint(), edge.endPoint()), key=lambda p: p.x)
    near = lambda p: abs(abs(p.y) - y) < 0.1 and abs(p.z - z) < 0.1
    found = [e for e in solid.edges().vals() if e.Length() > 1000 and near(first(e))]
    assert len(found) == 2
    return found
