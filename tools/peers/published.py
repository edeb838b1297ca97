#!/usr/bin/env python3
"""Writes the published forming cases of fixtures/published: tools as Nagata patches from closed forms, and scenes.

hemisphere: stretching of a clamped disc over a hemispherical punch (Code_Aster SSNV501).
bend: unconstrained cylindrical bending (NUMISHEET 2002 B, NAFEMS contact benchmark 3), a quarter of the strip.
cup: square cup (NUMISHEET'93), a quarter; tools/bench makes its tools from fixtures/forming/square_*.stp, beside the scene.
round_cup: round cup of AA6016-T4 (ESAFORM 2021), a quarter, drawn through.
draw: 2-D draw bending (NUMISHEET'93, mild steel), half of a millimetre of the strip in plane strain.
"""

import json
import math
import pathlib

from forming import cap, strip, write_tool

FIXTURES = pathlib.Path(__file__).resolve().parents[2] / "fixtures/published"


def revolve(chain, around):
    """A profile in the (r, z) half-plane, as (r, z, nr, nz), turned through the first quadrant; on the axis patches are
    triangles."""
    points, normals, patches, rings = [], [], [], []
    for j in range(around + 1):
        angle = math.pi / 2 * j / around
        c, s = math.cos(angle), math.sin(angle)
        ring = []
        for i, (r, z, nr, nz) in enumerate(chain):
            if r == 0.0 and j > 0:
                ring.append(rings[0][i])
                continue
            ring.append(len(points))
            points.append((r * c, r * s, z))
            normals.append((nr * c, nr * s, nz))
        rings.append(ring)
    for here, there in zip(rings, rings[1:]):
        for i in range(len(chain) - 1):
            (r0, z0), (r1, z1) = chain[i][:2], chain[i + 1][:2]
            # The normal of (a, b, b + row, a + row) is e_profile x e_around = (-dz, dr) in the half-plane.
            outward = -(z1 - z0) * (chain[i][2] + chain[i + 1][2]) + (r1 - r0) * (chain[i][3] + chain[i + 1][3])
            patch = list(dict.fromkeys((here[i], here[i + 1], there[i + 1], there[i])))
            patches.append(patch if outward > 0 else patch[::-1])
    return points, normals, patches


def arc(centre, radius, start, end, patches, side=1.0):
    """Points of an arc from one angle to another [degrees]; side -1: the normals point to its centre."""
    angles = [math.radians(start + (end - start) * k / patches) for k in range(patches + 1)]
    return [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a), side * math.cos(a), side * math.sin(a))
            for a in angles]


def write_scene(folder, scene):
    text = json.dumps({"format": "kanagata-scene", "version": 1, **scene}, indent=2)
    (folder / "case.scene.json").write_text(text + "\n")


def hemisphere(folder=FIXTURES / "hemisphere"):
    folder.mkdir(parents=True, exist_ok=True)
    punch, entry, clamp, thickness = 50.8, 6.35, 59.18, 1.0
    write_tool(folder / "punch.tool.json", cap(punch, math.radians(80), 6, thickness))
    die = [(clamp + 5, 0, 0, 1), *arc((clamp, -entry), entry, 90, 180, 4)]
    write_tool(folder / "die.tool.json", revolve(die, 8))
    tool = lambda name, up: {"name": name, "file": f"{name}.tool.json", "direction": [0, 0, up],
                             "place": {"shift": [0, 0, 0]}}
    write_scene(folder, {
        "name": "Hemispherical punch stretching, SSNV501",
        "blank": {"shape": {"quarter_disc": {"radius_mm": clamp, "core": 10, "rings": 24}},
                  "thickness_mm": thickness, "layers": 1, "element": {"solid-shell": {}}},
        "material": "sheet-ssnv501",
        "symmetry": [{"normal": "x"}, {"normal": "y"}],
        "holds": [{"where": {"beyond_radius_mm": clamp - 1e-6}, "axes": ["x", "y", "z"]}],
        "tools": [tool("punch", -1), tool("die", 1)],
        "stages": [{"name": "stretch", "drive": {"punch": {"travel_mm": 46.0}}, "largest_increment": 0.01}],
        "output": {"vtu_every": 0},
    })


def bend(folder=FIXTURES / "bend"):
    folder.mkdir(parents=True, exist_ok=True)
    punch, die, shoulder, length, width, thickness, stroke = 23.5, 25.0, 4.0, 120.0, 30.0, 1.0, 28.5
    up = 60.0
    nose = [*arc((0, thickness + punch), punch, -90, 0, 4), (punch, thickness + punch + up, 1, 0)]
    write_tool(folder / "punch.tool.json", strip(nose, -1.0, 25.0))
    trough = [(70, 0, 0, 1), *arc((die + shoulder, -shoulder), shoulder, 90, 180, 3)]
    trough += [point for point in arc((0, -shoulder), die, 0, -90, 4, -1.0)][1:]
    write_tool(folder / "die.tool.json", strip(trough, -1.0, 25.0))
    tool = lambda name, up: {"name": name, "file": f"{name}.tool.json", "direction": [0, 0, up], "friction": 0.1342,
                             "place": {"shift": [0, 0, 0]}}
    write_scene(folder, {
        "name": "Unconstrained cylindrical bending, NUMISHEET 2002 B",
        "blank": {"shape": {"rectangle": {"size_mm": [length / 2, width / 2], "elements": [60, 6]}},
                  "thickness_mm": thickness, "layers": 1, "element": {"solid-shell": {"points": 7}}},
        "material": "aluminium-numisheet2002b",
        "symmetry": [{"normal": "x"}, {"normal": "y"}],
        "tools": [tool("punch", -1), tool("die", 1)],
        "stages": [{"name": "bend", "drive": {"punch": {"travel_mm": stroke}},
                    "first_increment": 0.01, "largest_increment": 0.04},
                   {"name": "release", "drive": {"punch": {"release": True}, "die": {"release": True}},
                    "largest_increment": 0.25}],
        "output": {"vtu_every": 0},
    })


def cup(folder, elements=30, largest=0.02):
    """The tools die, holder and punch are expected beside the scene."""
    folder.mkdir(parents=True, exist_ok=True)
    tool = lambda name, up: {"name": name, "file": f"{name}.tool.json", "direction": [0, 0, up], "friction": 0.162}
    draw = lambda name, travel: {"name": name, "drive": {"punch": {"travel_mm": travel}}, "largest_increment": largest}
    write_scene(folder, {
        "name": "Square cup, NUMISHEET'93",
        "blank": {"shape": {"rectangle": {"size_mm": [75.0, 75.0], "elements": [elements, elements]}},
                  "thickness_mm": 0.81, "layers": 1, "element": {"solid-shell": {}}},
        "material": "aluminium-numisheet93-cup",
        "symmetry": [{"normal": "x"}, {"normal": "y"}],
        "tools": [tool("die", 1), tool("holder", -1), tool("punch", -1)],
        "stages": [{"name": "clamp", "drive": {"holder": {"force_n": 19600.0}},
                    "first_increment": 0.25, "largest_increment": 1.0},
                   draw("to 15 mm", 15.0), draw("to 40 mm", 40.0)],
        "output": {"vtu_every": 0},
    })


def round_cup(folder=FIXTURES / "round-cup", core=8, rings=22, largest=0.02, holder=40e3):
    folder.mkdir(parents=True, exist_ok=True)
    blank, punch, nose, die, shoulder, thickness, stroke = 53.75, 30.0, 5.0, 31.2, 10.0, 1.0, 48.0
    # Blocks between holder and die, hardly lower than the sheet is thick; else the holder's force would push the rim into the die.
    stop = 0.01
    outside, below = blank + 10, stroke + 30
    chains = {
        "die": [(outside, 0, 0, 1), *arc((die + shoulder, -shoulder), shoulder, 90, 180, 4), (die, -below, -1, 0)],
        "holder": [(die, thickness, 0, -1), (outside, thickness, 0, -1)],
        "punch": [(0.0, thickness, 0, -1), *arc((punch - nose, thickness + nose), nose, -90, 0, 4), (punch, below, 1, 0)],
    }
    for name, chain in chains.items():
        write_tool(folder / f"{name}.tool.json", revolve(chain, 8))
    tool = lambda name, up: {"name": name, "file": f"{name}.tool.json", "direction": [0, 0, up], "friction": 0.07,
                             "place": {"shift": [0, 0, 0]}}
    held_up = {**tool("holder", -1), "stop_mm": stop}
    write_scene(folder, {
        "name": "Round cup of AA6016-T4, ESAFORM 2021",
        "blank": {"shape": {"quarter_disc": {"radius_mm": blank, "core": core, "rings": rings}},
                  "thickness_mm": thickness, "layers": 1, "element": {"solid-shell": {}}},
        "material": "aa6016-t4-esaform2021",
        "symmetry": [{"normal": "x"}, {"normal": "y"}],
        "tools": [tool("die", 1), held_up, tool("punch", -1)],
        "stages": [{"name": "clamp", "drive": {"holder": {"force_n": holder}},
                    "first_increment": 0.25, "largest_increment": 1.0},
                   {"name": "draw through", "drive": {"punch": {"travel_mm": stroke}}, "largest_increment": largest}],
        "output": {"vtu_every": 0},
    })


def draw(folder=FIXTURES / "draw", elements=175, largest=0.01, points=7):
    folder.mkdir(parents=True, exist_ok=True)
    half_length, thickness, half_punch, half_die, radius, stroke, patches = 175.0, 0.78, 25.0, 26.0, 5.0, 70.0, 4
    die = [(half_length + 5, 0, 0, 1), *arc((half_die + radius, -radius), radius, 90, 180, patches),
           (half_die, -stroke - 20, -1, 0)]
    nose = [(0, thickness, 0, -1), *arc((half_punch - radius, thickness + radius), radius, -90, 0, patches),
            (half_punch, thickness + stroke + 20, 1, 0)]
    holder = [(half_die + radius, thickness, 0, -1), (half_length + 5, thickness, 0, -1)]
    for name, chain in (("die", die), ("punch", nose), ("holder", holder)):
        write_tool(folder / f"{name}.tool.json", strip(chain, -0.5, 1.5))
    tool = lambda name, up: {"name": name, "file": f"{name}.tool.json", "direction": [0, 0, up], "friction": 0.144,
                             "place": {"shift": [0, 0, 0]}}
    release = {name: {"release": True} for name in ("punch", "holder", "die")}
    write_scene(folder, {
        "name": "2-D draw bending, NUMISHEET'93",
        "blank": {"shape": {"rectangle": {"size_mm": [half_length, 1.0], "elements": [elements, 1]}},
                  "thickness_mm": thickness, "layers": 1, "element": {"solid-shell": {"points": points}}},
        "material": "mild-steel-numisheet93",
        "symmetry": [{"normal": "x"}],
        "holds": [{"where": {"all": True}, "axes": ["y"]}],
        "tools": [tool("die", 1), tool("holder", -1), tool("punch", -1)],
        "stages": [{"name": "clamp", "drive": {"holder": {"force_n": 70.0}}, "first_increment": 0.25},
                   {"name": "draw", "drive": {"punch": {"travel_mm": stroke}}, "largest_increment": largest},
                   {"name": "release", "drive": release, "largest_increment": 0.25}],
        "output": {"vtu_every": 0},
    })


if __name__ == "__main__":
    hemisphere()
    bend()
    round_cup()
    draw()
