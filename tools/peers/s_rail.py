#!/usr/bin/env python3
"""Makes the CAD of an S-shaped rail, as STEP solids, with an independent kernel: `pip install cadquery`, then
`tools/peers/s_rail.py FOLDER`. In the manner of NUMISHEET'96's S-rail; the plan is our own.

Centre line: straight, an arc to the left, one to the right, straight. The punch is 60 mm wide, the die 2 mm wider, both
rounded by 5 mm; the hole of the holder is 66 mm wide. All run on beyond the sheet at both ends."""
import math
import sys
from pathlib import Path

import cadquery as cq

RADIUS, TURN, STRAIGHT = 100.0, math.radians(40.0), 70.0
WIDTH, CLEARANCE, ROUNDING = 60.0, 1.0, 5.0
DEPTH, BREADTH = 60.0, 260.0
ALONG, ACROSS = RADIUS * math.sin(TURN), RADIUS * (1.0 - math.cos(TURN))
END = ALONG + STRAIGHT


def side(offset):
    """Points of a side, so far to the left of the centre line: ends of its pieces and the middles of its arcs."""

    def arc(angle, sign):
        r = RADIUS - sign * offset
        return (sign * (r * math.sin(angle) - ALONG), sign * (RADIUS - ACROSS - r * math.cos(angle)))

    return {
        "start": (-END, offset - ACROSS),
        "bend": arc(0.0, 1.0),
        "first": arc(TURN / 2, 1.0),
        "middle": arc(TURN, 1.0),
        "second": arc(TURN / 2, -1.0),
        "straight": arc(0.0, -1.0),
        "end": (END, offset + ACROSS),
    }


def outline(width):
    left, right = side(width / 2), side(-width / 2)
    path = cq.Workplane("XY").moveTo(*left["start"]).lineTo(*left["bend"])
    path = path.threePointArc(left["first"], left["middle"]).threePointArc(left["second"], left["straight"])
    path = path.lineTo(*left["end"]).lineTo(*right["end"]).lineTo(*right["straight"])
    path = path.threePointArc(right["second"], right["middle"]).threePointArc(right["first"], right["bend"])
    return path.lineTo(*right["start"]).close()


def rounded(solid, width):
    """Its edges along the rail at z = 0, rounded."""

    def along_the_rail(edge):
        box = edge.BoundingBox()
        flat = abs(box.zmin) < 1e-6 and abs(box.zmax) < 1e-6
        across = box.xmax - box.xmin < 1e-6
        return flat and not across and max(abs(box.ymin), abs(box.ymax)) < width / 2 + ACROSS + 1e-6

    return solid.fillet(ROUNDING, [e for e in solid.Edges() if along_the_rail(e)])


def block(height):
    return cq.Workplane("XY").box(2 * END, BREADTH, height).translate((0, 0, height / 2))


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    open_width = WIDTH + 2 * CLEARANCE
    die = block(DEPTH).translate((0, 0, -DEPTH)).cut(outline(open_width).extrude(-DEPTH))
    holder = block(20.0).cut(outline(WIDTH + 6.0).extrude(20.0))
    tools = {
        "punch": rounded(outline(WIDTH).extrude(DEPTH).val(), WIDTH),
        "die": rounded(die.val(), open_width),
        "holder": holder.val(),
    }
    for name, solid in tools.items():
        file = folder / f"{name}.step"
        cq.exporters.export(cq.Workplane(solid), str(file), opt={"write_pcurves": False})
        print(f"{name}: {len(solid.Faces())} faces, {file}")


if __name__ == "__main__":
    main()
