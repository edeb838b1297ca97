#!/usr/bin/env python3
"""Writes round shapes as an independent kernel (Open CASCADE, by `pip install cadquery`) has them, each as STEP with and
without parameter curves and as IGES of trimmed surfaces and of solids, for `tools/peers/cad_wild.py FOLDER`.

  tools/peers/cad_shapes.py FOLDER

Turned tools with rounded edges, pieces of tori and spheres, holes in them, pipes, shells and pockets: surfaces that close on
themselves, whose borders kernels write in their own ways."""
import pathlib
import sys

import cadquery as cq
from OCP.IGESControl import IGESControl_Writer


def circles(solid, z, radius=None):
    """Its edges that are circles at a height about the axis z, of a radius or of any."""

    def wanted(edge):
        box = edge.BoundingBox()
        flat = max(abs(box.zmin - z), abs(box.zmax - z)) < 1e-6
        return flat and (radius is None or abs(box.xmax - radius) < 1e-6)

    return [edge for edge in solid.Edges() if wanted(edge)]


def turned(shapes):
    for height in (60.0, -60.0):
        ring = cq.Workplane("XY").circle(110).circle(51.3).extrude(height).val()
        for z in (0.0, height):
            for radius in (51.3, 110.0):
                shapes[f"ring{height:+.0f}_{z:+.0f}_{radius:.0f}"] = ring.fillet(7, circles(ring, z, radius))
        shapes[f"ring{height:+.0f}_both"] = ring.fillet(7, circles(ring, 0.0))
        rod = cq.Workplane("XY").circle(40).extrude(height).val()
        for z in (0.0, height):
            shapes[f"rod{height:+.0f}_{z:+.0f}"] = rod.fillet(8, circles(rod, z))
        shapes[f"rod{height:+.0f}_chamfer"] = rod.chamfer(5, None, circles(rod, 0.0))
    profile = cq.Workplane("XZ").moveTo(0, 0).lineTo(40, 0).threePointArc((46, 4), (50, 10))
    profile = profile.spline([(55, 25), (52, 40)], includeCurrent=True).lineTo(0, 40).close()
    shapes["turned_spline"] = profile.revolve(360, (0, 0, 0), (0, 1, 0)).val()


def closed(shapes):
    torus, ball = cq.Solid.makeTorus(50, 10), cq.Solid.makeSphere(30, angleDegrees1=-90, angleDegrees2=90)
    shapes |= {"torus": torus, "ball": ball, "tip": cq.Solid.makeCone(30, 0, 40), "cone": cq.Solid.makeCone(30, 10, 40)}
    shapes["torus_half_turn"] = cq.Solid.makeTorus(50, 10, angleDegrees1=0, angleDegrees2=180)
    shapes["torus_slice"] = cq.Solid.makeTorus(50, 10, angleDegrees1=30, angleDegrees2=200)
    shapes["cap"] = cq.Solid.makeSphere(30, angleDegrees1=10, angleDegrees2=90)
    shapes["zone"] = cq.Solid.makeSphere(30, angleDegrees1=-40, angleDegrees2=50)
    half = cq.Workplane("XY").box(200, 200, 40).translate((0, 0, 20))
    shapes["torus_lower_half"] = cq.Workplane(torus).cut(half).val()
    shapes["torus_notched"] = cq.Workplane(torus).cut(cq.Workplane("XY").box(30, 30, 30).translate((50, 0, 0))).val()
    drill = cq.Workplane("XY").circle(3).extrude(40)
    shapes["torus_hole"] = cq.Workplane(torus).cut(drill.translate((50, 0, 0))).val()
    shapes["ball_hole_side"] = cq.Workplane(ball).cut(cq.Workplane("YZ").circle(6).extrude(80)).val()
    shapes["ball_hole_pole"] = cq.Workplane(ball).cut(cq.Workplane("XY").circle(6).extrude(80)).val()


def built(shapes):
    path = cq.Workplane("XY").moveTo(0, 0).threePointArc((30, 12), (60, 0))
    shapes["pipe"] = cq.Workplane("YZ").circle(5).sweep(path).val()
    block = cq.Workplane("XY").box(80, 60, 40)
    shapes["block"] = block.edges().fillet(8).val()
    bore = cq.Workplane("XY").circle(15).extrude(100, both=True)
    shapes["block_bored"] = block.cut(bore).edges("%CIRCLE").fillet(3).val()
    shapes["shell"] = block.edges("|Z").fillet(10).faces(">Z").shell(-3).val()
    upright = cq.Workplane("XY").circle(20).extrude(60)
    across = cq.Workplane("YZ").circle(12).extrude(80).translate((-40, 0, 30))
    shapes |= {"cross": upright.union(across).val(), "cross_bored": upright.cut(across).val()}


def to_the_axis(shapes):
    """Turned about z from profiles that reach the axis. A circle through three rounded points is one of a centre beside the
    axis: a surface of revolution, not a sphere."""

    def turn(profile, angle=360):
        return profile.revolve(angle, (0, 0, 0), (0, 1, 0)).val()

    def plane():
        return cq.Workplane("XZ")

    def punch(angle=360):
        nose = plane().moveTo(0, 0).threePointArc((25 * 0.70710678, 25 - 25 * 0.70710678), (25, 25))
        return turn(nose.lineTo(25, 45).lineTo(0, 45).close(), angle)

    def ellipse(across, along, angle=360):
        return turn(plane().ellipseArc(across, along, -90, 90, startAtCurrent=False).close(), angle)

    shapes |= {f"dome_{angle}": punch(angle) for angle in (360, 270, 180, 90, 30)}
    shapes["dome_tilted"] = cq.Workplane(punch()).rotate((0, 0, 0), (1, 2, 0.5), 37).translate((100, -40, 7)).val()
    half = cq.Workplane("XY").box(60, 60, 200)
    shapes["dome_halved"] = cq.Workplane(punch()).cut(half.translate((30, 0, 0))).val()
    shapes["dome_cut"] = cq.Workplane(punch()).cut(half.translate((35, 0, 0))).val()
    shapes["dome_bored"] = cq.Workplane(punch()).cut(cq.Workplane("XY").circle(4).extrude(30)).val()
    shapes |= {"ellipsoid": ellipse(30, 15), "ellipsoid_90": ellipse(15, 30, 90)}
    shapes["ellipsoid_halved"] = cq.Workplane(ellipse(30, 15)).cut(half.translate((30, 0, 0))).val()
    shapes["lemon"] = turn(plane().moveTo(0, -15).threePointArc((10, 0), (0, 15)).close())
    shapes["apple"] = turn(plane().moveTo(0, -12).threePointArc((30, 0), (0, 12)).close())
    shapes["ogive"] = turn(plane().moveTo(0, 0).threePointArc((14, 10), (20, 25)).lineTo(20, 40).lineTo(0, 40).close())
    for angle in (360, 180, 90):
        nose = plane().moveTo(0, 0).spline([(10, 1.5), (20, 9), (25, 25)], tangents=[(1, 0), (0, 1)], includeCurrent=True)
        shapes[f"spline_{angle}"] = turn(nose.lineTo(25, 45).lineTo(0, 45).close(), angle)
        shapes[f"apex_{angle}"] = turn(plane().moveTo(0, 0).lineTo(20, 30).lineTo(0, 30).close(), angle)
    nose = plane().moveTo(0, 0).lineTo(15, 0).threePointArc((15 + 10 * 0.70710678, 10 - 10 * 0.70710678), (25, 10))
    shapes["torus_nose"] = turn(nose.lineTo(25, 45).lineTo(0, 45).close())


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    shapes = {}
    for make in (turned, closed, built, to_the_axis):
        make(shapes)
    for name, solid in shapes.items():
        for suffix, curves in (("", True), ("_plain", False)):
            file = folder / f"{name}{suffix}.stp"
            cq.exporters.export(cq.Workplane(solid), str(file), "STEP", opt={"write_pcurves": curves})
        for suffix, mode in (("144", 0), ("186", 1)):
            writer = IGESControl_Writer("MM", mode)
            writer.AddShape(solid.wrapped)
            writer.ComputeModel()
            writer.Write(str(folder / f"{name}_{suffix}.igs"))
    print(f"{len(shapes)} shapes, {4 * len(shapes)} files in {folder}")


if __name__ == "__main__":
    main()
