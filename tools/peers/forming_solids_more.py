"""Tools of the later scenes of forming_scenes.py, as solids of CadQuery, each with the way that its side for the sheet looks."""

import cadquery as cq

from forming_solids import along_y, bar, block, cone, inner, punch, ring, solids as earlier

SPOTS = [(-12, -6), (0, -6), (12, -6), (12, 7), (0, 5), (-12, 7)]


def near(x, y, z0, z1):
    return cq.selectors.BoxSelector((-x, -y, z0), (x, y, z1))


def rod(x, radius, z):
    return cq.Workplane("XZ").center(x, z).circle(radius).extrude(-60).translate((0, -20, 0))


def hem():
    die = along_y(bar([(-60, -40), (0, -40), (0, 0), (-60, 0)]), 0, 0, 1)
    wiper = along_y(bar([(1.05, 0), (41.1, 0), (41.1, 40), (1.05, 40)]), 1.05, 0, 3)
    pad = cq.Workplane("XY").box(70, 60, 10, centered=False).translate((-60, -5, 0))
    pre = bar([(0, -30), (30, -30), (30, 0), (25, 0), (-5, -30)])
    return {
        "die": (die, "+z"), "inner": (block(-60, -14, -8, 0), "+z"), "pad": (pad, "-z"), "wipe": (wiper, "-z"),
        "pre": (pre, "-x"), "flat": (block(-60, 30, -60, -40), "+z"),
    }


def shrink():
    return {
        "die": (punch(40, 3, -40, 0, ">Z"), "+z"),
        "pad": (cq.Workplane("XY").circle(36).extrude(10), "-z"),
        "wipe": (inner(ring(70, 41, 0, 40), "<Z", 4), "-z"),
    }


def section(points):
    """A sector of 40 degrees of a ring about the z axis with this section, its middle on the x axis."""
    whole = cq.Workplane("XZ").polyline(points).close().revolve(40, (0, 0, 0), (0, 1, 0))
    return whole.rotate((0, 0, 0), (0, 0, 1), -20)


def crash():
    die = section([(220, -50), (380, -50), (380, 0), (326.6, 0), (322.6, -30), (277.4, -30), (273.4, 0), (220, 0)])
    inside = lambda edge: 273 < edge.radius() < 327
    die = die.newObject([edge for edge in die.edges("%CIRCLE").vals() if inside(edge)]).fillet(5)
    stamp = section([(279, -28.4), (321, -28.4), (326.6, 20), (273.4, 20)])
    stamp = stamp.edges("%CIRCLE").edges(near(400, 400, -29, -27)).fillet(6)
    return {"die": (die, "+z"), "punch": (stamp, "-z")}


def coin():
    stamp = cone([(0, -0.3), (2, -0.3), (3.5, 0), (14, 0), (14, 5), (0, 5)]).edges(near(9, 9, -0.31, -0.29)).fillet(0.4)
    return {"die": (cq.Workplane("XY").circle(14).extrude(-5), "+z"), "punch": (stamp, "-z")}


def joggle():
    step = [(30, -1.5), (0.8, -1.5), (-0.8, 0), (-30, 0)]
    rounded = lambda solid, high, low: along_y(along_y(solid, -0.8, 0, high), 0.8, -1.5, low)
    return {
        "die": (rounded(bar([(-30, -10), (30, -10), *step]), 1.5, 1.0), "+z"),
        "punch": (rounded(bar([(-30, 10), (30, 10), *step]), 1.0, 1.5), "-z"),
    }


def clinch():
    die = cone([(0, -5), (0, -1.2), (4, -1.2), (4.2, 0), (14, 0), (14, -5)]).edges(near(4.3, 4.3, -0.1, 0.1)).fillet(0.5)
    return {"die": (die, "+z"), "holder": (ring(12, 4.2, 0, 5), "-z"), "punch": (punch(2.5, 0.5, 0, 8, "<Z"), "-z")}


def restrike():
    """Twice the same hat, the second with sharper edges."""
    out = {}
    for nth, x, radius in [("", 26.3, 8), ("2", 26.2, 3)]:
        out["die" + nth] = (along_y(block(x, 90, -40, 0), x, 0, radius), "+z")
        out["holder" + nth] = (block(27, 90, 0, 10), "-z")
        out["punch" + nth] = (along_y(block(-30, 25, 0, 50), 25, 0, radius), "-z")
    return out


def level():
    out = {}
    for nth, x in [("1", -50), ("2", 50)]:
        out |= {"low" + nth: (rod(x, 10, -10), "+z"), "top" + nth: (rod(x, 10, 10), "-z")}
    return out | {"down": (rod(0, 12, 12), "-z"), "up": (rod(0, 12, -12), "+z")}


def pouch():
    hole = lambda high: cq.Workplane("XY").rect(60, 44).extrude(high).edges("|Z").fillet(4)
    die = cq.Workplane("XY").rect(120, 100).extrude(-10).cut(hole(-10)).faces(">Z").edges(near(31, 23, -1, 1)).fillet(1)
    stamp = cq.Workplane("XY").rect(59.4, 43.4).extrude(10).edges("|Z").fillet(3.7).faces("<Z").edges().fillet(1.2)
    holder = cq.Workplane("XY").rect(120, 100).extrude(8).cut(hole(8))
    return {"die": (die, "+z"), "holder": (holder, "-z"), "punch": (stamp, "-z")}


def plates():
    return {"die": (cq.Workplane("XY").circle(20).extrude(-5), "+z"), "punch": (cq.Workplane("XY").circle(20).extrude(5), "-z")}


def dimples():
    return {f"ball{k}": (cq.Workplane("XY").sphere(6).translate((x, y, 6)), "-z") for k, (x, y) in enumerate(SPOTS)}


OWN = {
    "stretch-bend": lambda: {"punch": (rod(15, 40, -40), "+z")},
    "crush": lambda: {"plate": (cq.Workplane("XY").box(10, 80, 60, centered=False).translate((30, -40, -10)), "-x")},
    "counter": lambda: earlier("cup") | {"counter": (punch(49, 2, -30, 0, ">Z"), "+z")},
    "hem": hem, "shrink": shrink, "crash": crash, "coin": coin, "upset": plates, "joggle": joggle, "clinch": clinch,
    "restrike": restrike, "dimples": dimples, "level": level, "pouch": pouch,
}


def solids(name):
    """Tools of a scene; the pulsed and the coarse cup have those of the cups before."""
    return OWN[name]() if name in OWN else earlier(name)
