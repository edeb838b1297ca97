"""Tools of the scenes of forming_scenes.py, as solids of CadQuery, each with the way that its side for the sheet looks."""

import cadquery as cq


def inner(solid, face, radius, nth=0):
    return solid.faces(face).edges(cq.selectors.RadiusNthSelector(nth)).fillet(radius)


def ring(outer, opening, low, high):
    return cq.Workplane("XY").workplane(offset=low).circle(outer).circle(opening).extrude(high - low)


def punch(radius, fillet, low, high, face):
    return cq.Workplane("XY").workplane(offset=low).circle(radius).extrude(high - low).faces(face).edges().fillet(fillet)


def bar(points, width=60):
    return cq.Workplane("XZ").polyline(points).close().extrude(-width).translate((0, -5, 0))


def block(x0, x1, z0, z1):
    return cq.Workplane("XY").box(x1 - x0, 20, z1 - z0, centered=False).translate((x0, -5, z0))


def channels(up, wider, back):
    """Flow channels of a bipolar plate: a period of 2 mm, 0.5 mm deep, walls at 73 degrees, all edges rounded by 0.2 mm."""
    points = []
    for k in range(-1, 3):
        points += [(2 * k - 0.4 - wider, up), (2 * k + 0.4 + wider, up)]
        points += [(2 * k + 0.55 + wider, up - 0.5), (2 * k + 1.45 - wider, up - 0.5)]
    ends = [(points[0][0], back), *points, (points[-1][0], back)]
    solid = cq.Workplane("XZ").polyline(ends).close().extrude(-3).translate((0, -1, 0))
    for x, z in points[1:-1]:
        near = cq.selectors.BoxSelector((x - 0.05, -9, z - 0.05), (x + 0.05, 9, z + 0.05))
        solid = solid.edges("|Y").edges(near).fillet(0.2)
    return solid


def cone(points):
    return cq.Workplane("XZ").polyline(points).close().revolve(360, (0, 0, 0), (0, 1, 0))


def along_y(solid, x, z, radius):
    return solid.edges("|Y").edges(cq.selectors.BoxSelector((x - 1, -100, z - 1), (x + 1, 100, z + 1))).fillet(radius)


def tray():
    kite = [(-60, -40), (55, -50), (70, 35), (-45, 50)]
    plate = lambda low, high: cq.Workplane("XY").workplane(offset=low).rect(240, 200).extrude(high - low)
    hole = lambda low, high: (
        cq.Workplane("XY").workplane(offset=low).polyline(kite).close().extrude(high - low).edges("|Z").fillet(14)
    )
    mouth = cq.selectors.BoxSelector((-100, -80, -1), (100, 80, 1))
    die = plate(-40, 0).cut(hole(-40, 0)).faces(">Z").edges(mouth).fillet(6)
    stamp = cq.Workplane("XY").polyline(kite).close().offset2D(-1.3).extrude(40).edges("|Z").fillet(12.7)
    slope = cq.Workplane("XZ").polyline([(-80, -1), (90, -1), (90, 9), (-80, 0)]).close().extrude(160)
    stamp = stamp.cut(slope.translate((0, 80, 0))).faces("<Z").edges().fillet(7)
    return {"die": (die, "+z"), "holder": (plate(0, 10).cut(hole(0, 10)), "-z"), "punch": (stamp, "-z")}


def solids(name):
    """Tools of a scene, each with the way that its side for the sheet looks."""
    if name == "hole-expansion":
        tip = cone([(0, -60), (25, -60), (25, -43.3), (2, -3.46), (0, -3.46)])
        tip = tip.edges(cq.selectors.BoxSelector((-3, -3, -4), (3, 3, -3))).fillet(1.9)
        die = inner(ring(70, 30, 0, 20), "<Z", 5)
        return {"die": (die, "-z"), "holder": (ring(70, 31, -10, 0), "+z"), "punch": (tip, "+z")}
    if name == "nakazima":
        ball = cq.Workplane("XY").sphere(50).translate((0, 0, -50))
        die = inner(ring(100, 55, 0, 20), "<Z", 6)
        return {"die": (die, "-z"), "holder": (ring(100, 56, -10, 0), "+z"), "punch": (ball, "+z")}
    if name == "redraw":
        second = inner(inner(ring(44.3, 31.3, 0, 60), "<Z", 5), "<Z", 7, 1)
        return {
            "die": (inner(ring(100, 46.3, -60, 0), ">Z", 7), "+z"),
            "holder": (ring(100, 47, 0, 10), "-z"),
            "punch": (punch(45, 8, 0, 60, "<Z"), "-z"),
            "die2": (second, "-z"),
            "punch2": (punch(30, 6, -60, 0, ">Z"), "+z"),
        }
    if name in ("wipe", "wipe-sharp"):
        die = bar([(-60, -40), (0, -40), (0, 0), (-60, 0)])
        wiper = bar([(1.1, 0), (41.1, 0), (41.1, 40), (1.1, 40)])
        if name == "wipe":
            die, wiper = along_y(die, 0, 0, 2), along_y(wiper, 1.1, 0, 4)
        pad = cq.Workplane("XY").box(56, 60, 10, centered=False).translate((-60, -5, 0))
        return {"die": (die, "+z"), "pad": (pad, "-z"), "wipe": (wiper, "-z")}
    if name == "tray":
        return tray()
    if name == "knife":
        return {
            "die": (bar([(12, 0), (40, 0), (40, -30), (12, -30)], 40), "+z"),
            "punch": (bar([(0, 0), (12, 22), (-12, 22)], 40), "-z"),
        }
    if name == "ironing":
        die = inner(ring(60, 20.85, -40, 0), ">Z", 6)
        return {"die": (die, "+z"), "holder": (ring(60, 21, 0, 10), "-z"), "punch": (punch(20, 5, 0, 50, "<Z"), "-z")}
    if name == "needle":
        tip = cone([(0, 0), (12, 25), (0, 25)])
        return {"die": (ring(45, 15, -20, 0), "+z"), "holder": (ring(45, 15, 0, 10), "-z"), "punch": (tip, "-z")}
    return later(name)


def later(name):
    """Tools of the scenes that came after the first nine."""
    if name == "erichsen":
        ball = cq.Workplane("XY").sphere(10).translate((0, 0, -10))
        die = inner(ring(27.5, 13.5, 0, 10), "<Z", 0.75)
        return {"die": (die, "-z"), "holder": (ring(27.5, 16.5, -10, 0), "+z"), "punch": (ball, "+z")}
    if name == "bead":
        die = block(31.3, 110, -20, 0).cut(block(58, 68, -6, 5))
        die = along_y(along_y(along_y(die, 31.3, 0, 8), 58, 0, 3), 68, 0, 3)
        bead = block(59, 67, -4, 6).edges("|Y").edges("<Z").fillet(3.9)
        stamp = along_y(block(-40, 30, 0, 60), 30, 0, 8)
        return {"die": (die, "+z"), "holder": (block(31.3, 110, 0, 12).union(bead), "-z"), "punch": (stamp, "-z")}
    if name == "flare":
        return {"cone": (cone([(0, -30), (14, -30), (46, 18), (0, 18)]), "-z")}
    if name == "nose":
        return {"cone": (cone([(60, -2), (22, -2), (8, 40), (60, 40)]), "-z")}
    if name == "vee":
        die = along_y(bar([(0, -25), (0, -20), (20, 0), (45, 0), (45, -25)], 30), 20, 0, 3)
        stamp = along_y(bar([(-20, 20), (0, 0), (20, 20), (20, 40), (-20, 40)], 30), 0, 0, 3)
        return {"die": (die, "+z"), "punch": (stamp, "-z")}
    if name == "channels":
        return {"die": (channels(0, 0, -3), "+z"), "punch": (channels(0.1, 0.09, 3), "-z")}
    if name == "conical":
        die = inner(ring(80, 41.5, -40, 0), ">Z", 8)
        bottom = cq.selectors.BoxSelector((-30, -30, -1), (30, 30, 1))
        stamp = cone([(0, 0), (25, 0), (40, 40), (0, 40)]).edges(bottom).fillet(5)
        return {"die": (die, "+z"), "punch": (stamp, "-z")}
    if name == "emboss":
        plate = lambda low: cq.Workplane("XY").workplane(offset=low).circle(30).extrude(10)
        return {
            "die": (inner(ring(30, 7.5, -10, 0), ">Z", 1.5), "+z"),
            "holder": (ring(30, 8, 0, 10), "-z"),
            "punch": (punch(6, 2, 0, 15, "<Z"), "-z"),
            "low": (plate(-10), "+z"),
            "flat": (plate(0), "-z"),
        }
    die = inner(ring(110, 51.3, -60, 0), ">Z", 7)
    return {"die": (die, "+z"), "holder": (ring(110, 52, 0, 10), "-z"), "punch": (punch(50, 6, 0, 60, "<Z"), "-z")}
