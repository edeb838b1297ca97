"""Skins and doubly curved surfaces of `tools/peers/dies.py`. Skins are open shells. Lengths in mm."""

import math

import cadquery as cq
import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Sewing
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
from OCP.Geom import Geom_OffsetSurface
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Vec
from OCP.TColgp import TColgp_Array2OfPnt

from dies_solids import GREY, ORANGE, frustum, rounded


def spline_surface(height, half, counts=(13, 11)):
    """B-spline surface of degree 3 through a grid of points of z = height(x, y) over a rectangle."""
    points = TColgp_Array2OfPnt(1, counts[0], 1, counts[1])
    for i in range(counts[0]):
        for j in range(counts[1]):
            x, y = half[0] * (2 * i / (counts[0] - 1) - 1), half[1] * (2 * j / (counts[1] - 1) - 1)
            points.SetValue(i + 1, j + 1, gp_Pnt(x, y, height(x, y)))
    maker = GeomAPI_PointsToBSplineSurface()
    maker.Interpolate(points)
    return maker.Surface()


def column(surface, low, high):
    """What lies between two copies of a surface, moved along z by `low` and `high`."""
    face = cq.Shape.cast(BRepBuilderAPI_MakeFace(surface, 1e-7).Face()).translate(cq.Vector(0, 0, low))
    return cq.Workplane(cq.Shape.cast(BRepPrimAPI_MakePrism(face.wrapped, gp_Vec(0, 0, high - low)).Shape()))


def rim(solid, height, lift, outline):
    """Edges on the surface z = height(x, y) + lift whose ends and middle lie in a box of the plane (x0, y0, x1, y1)."""
    x0, y0, x1, y1 = outline
    found = []
    for edge in solid.edges().vals():
        points = [edge.positionAt(t) for t in (0, 0.5, 1)]
        if all(x0 < p.x < x1 and y0 < p.y < y1 and abs(p.z - height(p.x, p.y) - lift) < 0.7 for p in points):
            found.append(edge)
    return cq.Workplane(solid.val()).newObject(found)


def embossed(solid, surface, height, sketch, at, turn, lift, draft, radii):
    """A bead on (lift > 0) or in a surface: drafted walls, its top or floor at a constant height over the surface. Radii of
    the edge at the surface and of that at the top or floor."""
    size = frustum(sketch, 1, 0, 0, at, turn).val().BoundingBox()
    outline = (size.xmin - 12, size.ymin - 12, size.xmax + 12, size.ymax + 12)
    across, along = np.linspace(size.xmin, size.xmax, 9), np.linspace(size.ymin, size.ymax, 9)
    heights = [height(x, y) for x in across for y in along]
    low, high = min(heights) - max(-lift, 0) - 2, max(heights) + max(lift, 0) + 2
    if lift > 0:
        solid = solid.union(frustum(sketch, high - low, draft, low, at, turn).cut(column(surface, lift, 300)))
    else:
        solid = solid.cut(frustum(sketch, low - high, draft, high, at, turn).cut(column(surface, -300, lift)))
    solid = rim(solid, height, 0, outline).fillet(radii[0])
    return rim(solid, height, lift, outline).fillet(radii[1])


def sewn(faces, tolerance=1e-5):
    sewing = BRepBuilderAPI_Sewing(tolerance)
    for face in faces:
        sewing.Add(face.wrapped)
    sewing.Perform()
    return cq.Shape.cast(sewing.SewedShape())


def crown(x, y):
    return -x * x / 1800 - y * y / 1100 + 4 * math.sin(x / 110) * math.cos(y / 140)


def beaded_skin():
    """Doubly curved skin 600 x 400 with four beads (9 or 10 high or deep), a recess, six round and two slotted holes."""
    surface = spline_surface(crown, (300, 200))
    solid = column(surface, -260, 0)
    slot = lambda *size: cq.Sketch().slot(*size)
    for sketch, at, turn, lift, radii in (
        (slot(210, 48), (-205, 0), 90, 10, (6, 4)), (slot(210, 48), (-110, 0), 90, -10, (4, 6)),
        (slot(180, 46), (40, 105), 12, 9, (5, 4)), (slot(180, 46), (50, -110), -9, 9, (5, 3)),
        (rounded(130, 80, 30), (70, 0), 5, -12, (6, 7)), (cq.Sketch().circle(34), (215, 20), 0, 11, (6, 5)),
    ):
        solid = embossed(solid, surface, crown, sketch, at, turn, lift, 18, radii)
    drill = lambda sketch, at, turn=0: frustum(sketch, -600, 0, 200, at, turn)
    for radius, *at in ((12, -265, -160), (12, 265, -165), (12, -265, 160), (9, 262, 163), (15, 70, 0), (10, -30, 0)):
        solid = solid.cut(drill(cq.Sketch().circle(radius), at))
    for at, turn in (((170, -90), 35), ((-20, 165), -14)):
        solid = solid.cut(drill(slot(30, 14), at, turn))
    faces = [f for f in solid.faces().vals() if f.BoundingBox().zmin > -200]
    return [("beaded_skin", sewn(faces), GREY)]


def offset_skin():
    """A skin of 8 x 5 B-spline faces over 640 x 400 and, as OFFSET surfaces on the same B-splines, its offset by 0.8 upwards;
    two round holes and a slotted one through both."""
    surface = spline_surface(lambda x, y: crown(x, y) + 5 * math.sin(y / 60), (320, 200), (25, 17))
    u0, u1, v0, v1 = surface.Bounds()
    skin, offset = [], []
    for i in range(8):
        for j in range(5):
            piece = surface.Copy()
            u, v = (u0 + (u1 - u0) * k / 8 for k in (i, i + 1)), (v0 + (v1 - v0) * k / 5 for k in (j, j + 1))
            piece.Segment(*u, *v, 1e-9, 1e-9)
            skin.append(cq.Shape.cast(BRepBuilderAPI_MakeFace(piece, 1e-7).Face()))
            offset.append(cq.Shape.cast(BRepBuilderAPI_MakeFace(Geom_OffsetSurface(piece, 0.8), 1e-7).Face()))
    drills = [frustum(cq.Sketch().circle(14), 400, 0, -250, at) for at in ((-200, 35), (130, -118))]
    drills.append(frustum(cq.Sketch().slot(46, 22), 400, 0, -250, (200, 45), 20))
    bodies = []
    for name, faces, colour in (("skin", skin, GREY), ("offset", offset, ORANGE)):
        shell = sewn(faces)
        for drill in drills:
            shell = shell.cut(drill.val())
        bodies.append((name, sewn(shell.Faces()), colour))
    return bodies


def swept_skin():
    """Hat-shaped skin swept along lines and arcs: seven spline profiles, extruded and revolved in turns (straight, bend of 35
    degrees, straight, bend back of 50, straight): surfaces of extrusion and of revolution. Bend radii 260 and 220."""
    corners = [(-130, 0), (-84, 2), (-70, 8), (-52, 58), (-38, 66), (40, 70), (54, 60), (74, 9), (90, 1), (132, -3)]
    whole = cq.Edge.makeSpline([cq.Vector(0, y, z) for y, z in corners])
    first, last = whole._bounds()
    cuts = [first + (last - first) * k / 7 for k in range(8)]
    profile = [whole.trim(a, b) for a, b in zip(cuts, cuts[1:])]
    faces, origin, heading = [], cq.Vector(0, 0, 0), 0.0
    for kind, value, radius in (("line", 180, 0), ("arc", 35, 260), ("line", 140, 0), ("arc", -50, 220), ("line", 160, 0)):
        along = cq.Vector(math.cos(math.radians(heading)), math.sin(math.radians(heading)), 0)
        here = [e.rotate(cq.Vector(), cq.Vector(0, 0, 1), heading).translate(origin) for e in profile]
        if kind == "line":
            reach = gp_Vec(*(along * value).toTuple())
            faces += [cq.Shape.cast(BRepPrimAPI_MakePrism(e.wrapped, reach, True).Shape()) for e in here]
            origin = origin + along * value
            continue
        centre = origin + cq.Vector(-along.y, along.x, 0) * math.copysign(radius, value)
        axis = gp_Ax1(gp_Pnt(*centre.toTuple()), gp_Dir(0, 0, math.copysign(1, value)))
        turn = math.radians(abs(value))
        faces += [cq.Shape.cast(BRepPrimAPI_MakeRevol(e.wrapped, axis, turn, True).Shape()) for e in here]
        origin = cq.Vertex.makeVertex(*origin.toTuple()).rotate(centre, centre + cq.Vector(0, 0, 1), value).Center()
        heading += value
    return [("swept_skin", sewn(faces), GREY)]
