#!/usr/bin/env python3
"""Forming scenes that the solver was not tuned to: tools made by CadQuery (STEP), two blanks meshed by gmsh, converted by
`kanagata`, run by `kanagata-solve`; prints a row of a table for each.

  forming_scenes.py FOLDER [--programs target/release] [--only NAME ...] [--tol 0.05]

Needs `pip install cadquery gmsh`. Scenes: hole-expansion, nakazima, redraw (reverse, five stages), wipe, wipe-sharp, tray
(nothing symmetric, holder on a spring), knife (sharp edges everywhere), ironing, needle.
"""

import argparse
import json
import math
import pathlib
import shutil
import subprocess

import cadquery as cq
import gmsh

MILD, AA6016, AA5754 = "mild-steel-neto2012", "aa6016-t4-esaform2021", "aa5754-o-coer2018"
QUARTER = [{"normal": "x"}, {"normal": "y"}]


def inner(solid, face, radius, nth=0):
    return solid.faces(face).edges(cq.selectors.RadiusNthSelector(nth)).fillet(radius)


def ring(outer, opening, low, high):
    return cq.Workplane("XY").workplane(offset=low).circle(outer).circle(opening).extrude(high - low)


def punch(radius, fillet, low, high, face):
    return cq.Workplane("XY").workplane(offset=low).circle(radius).extrude(high - low).faces(face).edges().fillet(fillet)


def bar(points, width=60):
    return cq.Workplane("XZ").polyline(points).close().extrude(-width).translate((0, -5, 0))


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
    tip = cone([(0, 0), (12, 25), (0, 25)])
    return {"die": (ring(45, 15, -20, 0), "+z"), "holder": (ring(45, 15, 0, 10), "-z"), "punch": (tip, "-z")}


def mesh(path, outline, size):
    """Quadrilaterals on the quarter of an outline that `outline` makes of gmsh's kernel."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    quarter = gmsh.model.occ.addRectangle(0, 0, 0, 100, 100)
    gmsh.model.occ.intersect(outline(gmsh.model.occ), [(2, quarter)])
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.setSizeCallback(lambda dim, tag, x, y, z, lc: size(math.hypot(x, y)))
    for option, value in [("RecombineAll", 1), ("Algorithm", 8), ("RecombinationAlgorithm", 3), ("SaveAll", 1)]:
        gmsh.option.setNumber("Mesh." + option, value)
    gmsh.model.mesh.generate(2)
    gmsh.write(str(path))
    gmsh.finalize()


def blank(name, folder):
    annulus = lambda k: k.cut([(2, k.addDisk(0, 0, 0, 65, 65))], [(2, k.addDisk(0, 0, 0, 5, 5))])[0]
    strip = lambda k: k.cut([(2, k.addDisk(0, 0, 0, 90, 90))], [(2, k.addDisk(0, 75, 0, 60, 60))])[0]
    rectangle = lambda size, count, corner: {"rectangle": {"size_mm": size, "elements": count, "corner_mm": corner}}
    disc = lambda radius, core, rings: {"quarter_disc": {"radius_mm": radius, "core": core, "rings": rings}}
    if name == "hole-expansion":
        mesh(folder / "blank.msh", annulus, lambda r: 0.8 + 2.7 * min(1, max(0, (r - 5) / 25)))
    elif name == "nakazima":
        mesh(folder / "blank.msh", strip, lambda r: 2.0 if r < 35 else 3.5)
    shapes = {
        "redraw": (disc(80, 8, 20), 1.0),
        "wipe": (rectangle([62, 50], [62, 10], [-45, 0]), 0.9),
        "wipe-sharp": (rectangle([62, 20], [80, 5], [-45, 0]), 0.9),
        "tray": (rectangle([230, 180], [58, 45], [-110, -90]), 1.0),
        "knife": (rectangle([30, 20], [60, 8], [0, 0]), 1.5),
        "ironing": (disc(36, 8, 20), 1.0),
        "needle": (disc(40, 8, 16), 0.5),
    }
    file = {"mesh": {"file": "blank.msh"}}
    shape, thickness = shapes.get(name, (file, 1.2 if name == "hole-expansion" else 1.0))
    return {"shape": shape, "thickness_mm": thickness, "element": "solid-shell"}


def force(newton):
    return {"force_n": newton}


def travel(mm):
    return {"travel_mm": mm}


# Material; friction by tool; shifts of tools that are not placed touching; stages by name, tool and drive; the rest.
SCENES = {
    "hole-expansion": ("mild-steel-numisheet93", {"die": 0.12, "holder": 0.12, "punch": 0.05}, {},
                       [("clamp", {"holder": force(150e3)}), ("expand", {"punch": travel(25)})],
                       {"symmetry": QUARTER, "holds": [{"where": {"beyond_radius_mm": 64.9}, "axes": ["x", "y"]}]}),
    "nakazima": (AA6016, {"die": 0.3, "holder": 0.3, "punch": 0.02}, {},
                 [("clamp", {"holder": force(200e3)}), ("dome", {"punch": travel(25)})],
                 {"symmetry": QUARTER, "holds": [{"where": {"beyond_radius_mm": 88}, "axes": ["x", "y"]}]}),
    "redraw": (MILD, {"die": 0.05, "holder": 0.05, "punch": 0.1, "die2": 0.05, "punch2": 0.1},
               {"die2": -38.5, "punch2": -41},
               [("clamp", {"holder": force(40e3), "die2": {"absent": True}, "punch2": {"absent": True}}),
                ("draw", {"punch": travel(40)}),
                ("off", {"punch": {"release": True}, "holder": {"release": True}}),
                ("seat", {"die2": travel(0.5), "punch2": travel(1)}),
                ("reverse", {"punch2": travel(30)})], {"symmetry": QUARTER}),
    "wipe": (AA6016, {"die": 0.1, "pad": 0.1, "wipe": 0.1}, {},
             [("clamp", {"pad": force(30e3)}), ("wipe", {"wipe": travel(25)})],
             {"holds": [{"where": {"plane": {"normal": "x", "at_mm": -45}}, "axes": ["x"]},
                        {"where": {"plane": {"normal": "y"}}, "axes": ["y"]}]}),
    "tray": (MILD, {"die": 0.12, "holder": 0.12, "punch": 0.12}, {},
             [("clamp", {"holder": {"spring": {"force_n": 60e3, "stiffness_n_per_mm": 3000}}}),
              ("draw", {"punch": travel(30)})], {}),
    "knife": ("aluminium-numisheet2002b", {"die": 0.2, "punch": 0.2}, {}, [("bend", {"punch": travel(16)})],
              {"symmetry": QUARTER}),
    "ironing": (AA5754, {"die": 0.05, "holder": 0.05, "punch": 0.1}, {},
                [("clamp", {"holder": force(5e3)}), ("draw", {"punch": travel(28)})], {"symmetry": QUARTER}),
    "needle": (MILD, {"die": 0.2, "holder": 0.2, "punch": 0.1}, {},
               [("clamp", {"holder": force(40e3)}), ("draw", {"punch": travel(8)})],
               {"symmetry": QUARTER, "holds": [{"where": {"beyond_radius_mm": 39.9}, "axes": ["x", "y"]}]}),
}
SCENES["wipe-sharp"] = (MILD, {"die": 0.15, "pad": 0.15, "wipe": 0.15}, {},
                        [("clamp", {"pad": force(30e3)}), ("wipe", {"wipe": travel(20)})], SCENES["wipe"][4])


def write(name, folder, programs, tol):
    folder.mkdir(parents=True, exist_ok=True)
    material, friction, shifts, stages, rest = SCENES[name]
    tools = []
    for tool, (solid, side) in solids(name).items():
        cq.exporters.export(solid, str(folder / f"{tool}.step"))
        subprocess.run(
            [programs / "kanagata", "convert", folder / f"{tool}.step", "--tol", str(tol), "--sheet-side", side,
             "-o", folder / f"{tool}.tool.json"],
            check=True, capture_output=True,
        )
        direction = [0, 0, 1 if side == "+z" else -1]
        entry = {"name": tool, "file": f"{tool}.tool.json", "direction": direction, "friction": friction[tool]}
        if tool in shifts:
            entry["place"] = {"shift": [0, 0, shifts[tool]]}
        tools.append(entry)
    stages = [{"name": stage, "drive": drive} for stage, drive in stages]
    gone = [t for t in friction if not (name == "redraw" and t in ("punch", "holder"))]
    stages.append({"name": "free", "drive": {tool: {"release": True} for tool in gone}})
    scene = {"format": "kanagata-scene", "version": 1, "name": name, "blank": blank(name, folder),
             "material": material, "tools": tools, "stages": stages, "output": {"vtu_every": 0}, **rest}
    path = folder / f"{name}.scene.json"
    path.write_text(json.dumps(scene, indent=1))
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("target/release"))
    parser.add_argument("--only", nargs="*", choices=sorted(SCENES))
    parser.add_argument("--tol", type=float, default=0.05)
    args = parser.parse_args()
    print("| scene | unknowns | increments | iterations | cuts | snaps | energy | order | processor [s] |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in args.only or SCENES:
        path = write(name, args.folder / name, args.programs, args.tol)
        out = args.folder / name / "run"
        shutil.rmtree(out, ignore_errors=True)
        done = subprocess.run(
            [args.programs / "kanagata-solve", "run", path, "-o", out, "--threads", "1"],
            capture_output=True, text=True,
        )
        if done.returncode != 0:
            print(f"| {name} | exit {done.returncode}: {done.stderr.strip().splitlines()[-1:]} |", flush=True)
            continue
        r = json.loads((out / "run.json").read_text())
        order = r.get("convergence_order")
        print(f"| {name} | {r['unknowns']} | {r['increments']} | {r['iterations']} | {r['cuts']} | {r['snaps']} "
              f"| {r['energy_balance']:.1e} | {order if order is None else round(order, 2)} | {r['cpu_s']:.1f} |", flush=True)


if __name__ == "__main__":
    main()
