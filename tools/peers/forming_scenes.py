#!/usr/bin/env python3
"""Forming scenes that the solver was not tuned to: tools made by CadQuery (STEP), two blanks meshed by gmsh, converted by
`kanagata`, run by `kanagata-solve`; prints a row of a table for each.

  forming_scenes.py FOLDER [--programs target/release] [--only NAME ...] [--tol 0.05]

Needs `pip install cadquery gmsh`. Scenes: hole-expansion, nakazima, redraw (reverse, five stages), wipe, wipe-sharp, tray
(nothing symmetric, holder on a spring), knife (sharp edges everywhere), ironing, needle; erichsen, bead (channel over a
drawbead), flare and nose (a tube of shuffled hexahedra in an Abaqus deck), vee (air bending, then bottoming by a force),
channels (bipolar plate of foil), conical (a cup drawn without a holder, which wrinkles), emboss (and pressed flat again), cups;
stretch-bend, hem (flanged, bent on, pressed flat), shrink (flange that wrinkles and is ironed), crash (hat curved in plan),
coin, upset (4 mm thick, six layers of hex8), joggle, clinch, restrike (hat drawn, then again with sharper edges), dimples (six
balls one after the other), level (bent to and fro), crush (tube between plates), coarse (cup of elements larger than the radii),
pulse (cup, punch to and fro, holder's force up and down), counter (cup, floor pinched), pouch (battery, foil of 0.15 mm).
"""

import argparse
import json
import math
import pathlib
import random
import shutil
import subprocess

import cadquery as cq
import gmsh

from forming_solids_more import SPOTS, solids

MILD, DEEP = "mild-steel-neto2012", "mild-steel-numisheet93"
AA6016, AA5754, AA2090 = "aa6016-t4-esaform2021", "aa5754-o-coer2018", "aa2090-t3-barlat2005"
AA6022, CYCLIC = "aa6022-t4-tian2017", "structural-steel-hartloper-uvc"
QUARTER = [{"normal": "x"}, {"normal": "y"}]


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


def tube(path, around, up, inner, thickness, height):
    """Deck of a quarter of a tube that stands on z = 0: nodes and elements numbered and listed at random."""
    number, cells = {}, []
    corners = [(i, j, k) for i in range(around + 1) for j in range(up + 1) for k in range(2)]
    draw = random.Random(5)
    draw.shuffle(corners)
    number = {corner: 7 + 3 * n for n, corner in enumerate(corners)}
    for i in range(around):
        for j in range(up):
            ring = [(j, 0), (j + 1, 0), (j + 1, 1), (j, 1)]
            cells.append([number[(i + a, *place)] for a in range(2) for place in ring])
    draw.shuffle(cells)
    with open(path, "w") as deck:
        deck.write("*HEADING\ntube\n*NODE\n")
        for i, j, k in corners:
            angle, radius = math.pi / 2 * i / around, inner + thickness * k
            x, y = (0.0 if i == around else math.cos(angle)), (0.0 if i == 0 else math.sin(angle))
            deck.write(f"{number[i, j, k]}, {radius * x:.12g}, {radius * y:.12g}, {height * j / up:.12g}\n")
        deck.write("*ELEMENT, TYPE=C3D8, ELSET=TUBE\n")
        for n, cell in enumerate(cells):
            deck.write(", ".join(map(str, [n + 11, *cell])) + "\n")


def blank(name, folder):
    annulus = lambda k: k.cut([(2, k.addDisk(0, 0, 0, 65, 65))], [(2, k.addDisk(0, 0, 0, 5, 5))])[0]
    strip = lambda k: k.cut([(2, k.addDisk(0, 0, 0, 90, 90))], [(2, k.addDisk(0, 75, 0, 60, 60))])[0]
    rectangle = lambda size, count, corner: {"rectangle": {"size_mm": size, "elements": count, "corner_mm": corner}}
    disc = lambda radius, core, rings: {"quarter_disc": {"radius_mm": radius, "core": core, "rings": rings}}
    if name == "hole-expansion":
        mesh(folder / "blank.msh", annulus, lambda r: 0.8 + 2.7 * min(1, max(0, (r - 5) / 25)))
    elif name == "nakazima":
        mesh(folder / "blank.msh", strip, lambda r: 2.0 if r < 35 else 3.5)
    if name in TUBES:
        tube(folder / "blank.inp", *TUBES[name])
        return {"shape": {"mesh": {"file": "blank.inp"}}, "element": "solid-shell", "rolling_direction": [0, 0, 1]}
    cup = (disc(85, 6, 14), 1.0)
    shapes = {
        "redraw": (disc(80, 8, 20), 1.0),
        "wipe": (rectangle([62, 50], [62, 10], [-45, 0]), 0.9),
        "wipe-sharp": (rectangle([62, 20], [80, 5], [-45, 0]), 0.9),
        "tray": (rectangle([230, 180], [58, 45], [-110, -90]), 1.0),
        "knife": (rectangle([30, 20], [60, 8], [0, 0]), 1.5),
        "ironing": (disc(36, 8, 20), 1.0),
        "needle": (disc(40, 8, 16), 0.5),
        "erichsen": (disc(45, 14, 30), 0.8),
        "bead": (rectangle([105, 1], [210, 1], [0, 0]), 0.8),
        "vee": (rectangle([40, 20], [80, 6], [0, 0]), 2.0),
        "channels": (rectangle([2, 0.1], [80, 1], [0, 0]), 0.1),
        "conical": (disc(70, 10, 24), 0.5),
        "emboss": (disc(25, 10, 16), 1.0),
        "cup-mild": cup, "cup-aa6016": cup, "cup-aa2090": cup, "pulse": cup, "counter": cup,
        "coarse": (disc(85, 4, 8), 1.0),
        "stretch-bend": (rectangle([200, 15], [100, 6], [-100, 0]), 1.2),
        "hem": (rectangle([52, 4], [130, 2], [-40, 0]), 1.0),
        "shrink": (disc(50, 16, 40), 0.8),
        "crash": (rectangle([110, 50], [74, 34], [245, 0]), 1.4),
        "coin": (disc(10, 16, 20), 1.0),
        "upset": (disc(10, 8, 8), 4.0),
        "joggle": (rectangle([40, 5], [100, 3], [-20, 0]), 1.5),
        "clinch": (disc(12, 14, 24), 1.5),
        "restrike": (rectangle([70, 1], [175, 1], [0, 0]), 1.0),
        "dimples": (rectangle([60, 40], [48, 32], [-30, -20]), 0.8),
        "level": (rectangle([130, 10], [64, 4], [-65, 0]), 2.0),
        "pouch": (rectangle([50, 40], [50, 40], [0, 0]), 0.15),
        "cup-aa2090-whole": ({"disc": {"radius_mm": 85, "core": 6, "rings": 14}}, 1.0),
    }
    file = {"mesh": {"file": "blank.msh"}}
    shape, thickness = shapes.get(name, (file, 1.2 if name == "hole-expansion" else 1.0))
    bulk = {"element": "hex8", "layers": 6} if name == "upset" else {"element": "solid-shell"}
    return {"shape": shape, "thickness_mm": thickness, **bulk}


def force(newton):
    return {"force_n": newton}


def travel(mm):
    return {"travel_mm": mm}


# Material; friction by tool; shifts of tools that are not placed touching; stages by name, tool and drive; the rest.
SCENES = {
    "hole-expansion": (DEEP, {"die": 0.12, "holder": 0.12, "punch": 0.05}, {},
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

BASE = {"where": {"plane": {"normal": "z"}}, "axes": ["x", "y", "z"]}
STRIP = {"symmetry": [{"normal": "x"}], "holds": [{"where": {"all": True}, "axes": ["y"]}]}
PERIOD = {"symmetry": [{"normal": "x"}, {"normal": "x", "at_mm": 2}], "holds": STRIP["holds"]}
CUP = [("clamp", {"holder": force(30e3)}), ("draw", {"punch": travel(30)})]
ABSENT, RELEASE = {"absent": True}, {"release": True}
SCENES |= {
    "erichsen": (AA6016, {"die": 0.12, "holder": 0.12, "punch": 0.05}, {},
                 [("clamp", {"holder": force(10e3)}), ("dome", {"punch": travel(9)})], {"symmetry": QUARTER}),
    "bead": (MILD, {"die": 0.1, "holder": 0.1, "punch": 0.1}, {},
             [("clamp", {"holder": force(800)}), ("draw", {"punch": travel(40)})], STRIP),
    "flare": (MILD, {"cone": 0.1}, {}, [("flare", {"cone": travel(25)})], {"symmetry": QUARTER, "holds": [BASE]}),
    "nose": (MILD, {"cone": 0.05}, {}, [("nose", {"cone": travel(14)})], {"symmetry": QUARTER, "holds": [BASE]}),
    "vee": (DEEP, {"die": 0.1, "punch": 0.1}, {},
            [("bend", {"punch": travel(15)}), ("bottom", {"punch": force(80e3)})], {"symmetry": QUARTER}),
    "channels": (DEEP, {"die": 0.1, "punch": 0.1}, {"punch": 0.5}, [("form", {"punch": travel(0.47)})], PERIOD),
    "conical": (AA5754, {"die": 0.08, "punch": 0.15}, {}, [("draw", {"punch": travel(35)})], {"symmetry": QUARTER}),
    "emboss": (AA6016, dict.fromkeys(["die", "holder", "punch", "low", "flat"], 0.1), {"low": -3.2},
               [("clamp", {"holder": force(20e3), "low": ABSENT, "flat": ABSENT}), ("emboss", {"punch": travel(3)}),
                ("off", {"punch": RELEASE, "holder": RELEASE, "die": RELEASE}),
                ("flatten", {"flat": force(60e3), "low": travel(0)})], {"symmetry": QUARTER}),
    "cup-mild": (MILD, dict.fromkeys(["die", "holder", "punch"], 0.06), {}, CUP, {"symmetry": QUARTER}),
}
SCENES["cup-aa6016"] = (AA6016, *SCENES["cup-mild"][1:])
SCENES["cup-aa2090"] = (AA2090, *SCENES["cup-mild"][1:])
SCENES["cup-aa2090-whole"] = (AA2090, *SCENES["cup-mild"][1:4], {})


def at(normal, place=0):
    return {"plane": {"normal": normal, "at_mm": place}}


def clamped(*planes):
    return [{"where": at(*plane), "axes": ["x", "y", "z"]} for plane in planes]


def mu(tools, value):
    return dict.fromkeys(tools.split(), value)


BALLS = [f"ball{k}" for k in range(len(SPOTS))]
PRESSES = [(f"press{k}", {ball: travel(4.5), **({BALLS[k - 1]: RELEASE} if k else dict.fromkeys(BALLS[1:], ABSENT))})
           for k, ball in enumerate(BALLS)]
TO_AND_FRO = travel([[0, 0], [0.3, 12], [0.4, 9], [0.7, 22], [0.8, 19], [1, 30]])
UP_AND_DOWN = force([[0, 30e3], [0.3, 30e3], [0.35, 5e3], [0.5, 40e3], [1, 20e3]])
SCENES |= {
    "stretch-bend": (AA6022, {"punch": 0.15}, {}, [("form", {"punch": travel(40)})],
                     {"symmetry": [{"normal": "y"}], "holds": clamped(("x", -100), ("x", 100))}),
    "hem": (AA6016, mu("die inner pad wipe pre flat", 0.1), {"pre": [22, 0, 0], "flat": 10},
            [("clamp", {"pad": force(8e3), "pre": ABSENT, "flat": ABSENT}), ("wipe", {"wipe": travel(16)}),
             ("off", {"wipe": RELEASE, "die": RELEASE}), ("pre", {"pre": travel(45)}), ("preoff", {"pre": RELEASE}),
             ("hem", {"flat": travel(27.5)})],
            {"holds": [{"where": at("x", -40), "axes": ["x", "z"]}, *STRIP["holds"]]}),
    "shrink": (AA5754, mu("die pad wipe", 0.1), {}, [("clamp", {"pad": force(20e3)}), ("wipe", {"wipe": travel(25)})],
               {"symmetry": QUARTER}),
    "crash": ("sheet-ssnv501", mu("die punch", 0.14), {}, [("form", {"punch": travel(30)})],
              {"symmetry": [{"normal": "y"}]}),
    "coin": (AA5754, mu("die punch", 0.15), {}, [("coin", {"punch": travel(0.3)})], {"symmetry": QUARTER}),
    "upset": (MILD, mu("die punch", 0.3), {}, [("upset", {"punch": travel(1.6)})], {"symmetry": QUARTER}),
    "joggle": (DEEP, mu("die punch", 0.12), {}, [("form", {"punch": force(60e3)})], {"holds": STRIP["holds"]}),
    "clinch": (MILD, mu("die holder punch", 0.12), {},
               [("clamp", {"holder": force(3e3)}), ("press", {"punch": travel(1.9)})], {"symmetry": QUARTER}),
    "restrike": (DEEP, mu("die holder punch die2 holder2 punch2", 0.1), {"die2": -40, "holder2": 10, "punch2": 10},
                 [("clamp", {"holder": force(1000), **dict.fromkeys(["die2", "punch2", "holder2"], ABSENT)}),
                  ("draw", {"punch": travel(30)}), ("off", dict.fromkeys(["punch", "holder", "die"], RELEASE)),
                  ("seat", {"die2": travel(40), "holder2": travel(8.9)}), ("hold", {"holder2": force(2000)}),
                  ("restrike", {"punch2": travel(41)})], STRIP),
    "dimples": (DEEP, dict.fromkeys(BALLS, 0.1), {}, PRESSES,
                {"holds": clamped(("x", -30), ("x", 30), ("y", -20), ("y", 20))}),
    "level": (CYCLIC, mu("low1 low2 top1 top2 down up", 0.05), {"up": -14, "down": 16},
              [("down1", {"down": travel(26)}), ("change1", {"down": travel(0)}), ("up1", {"up": travel(25)}),
               ("change2", {"up": travel(0)}), ("down2", {"down": travel(22)}), ("change3", {"down": travel(0)}),
               ("up2", {"up": travel(20)}), ("back", {"up": travel(0)})],
              {"holds": [{"where": at("y"), "axes": ["y"]}, {"where": at("x"), "axes": ["x"]}]}),
    "crush": (MILD, {"plate": 0.1}, {}, [("crush", {"plate": travel(15)})], {"symmetry": [*QUARTER, {"normal": "z"}]}),
    "coarse": SCENES["cup-mild"],
    "pulse": (MILD, mu("die holder punch", 0.06), {},
              [CUP[0], ("draw", {"punch": TO_AND_FRO, "holder": UP_AND_DOWN})], {"symmetry": QUARTER}),
    "counter": (MILD, {"die": 0.06, "holder": 0.06, "punch": 0.1, "counter": 0.1}, {},
                [("clamp", {"holder": force(30e3), "counter": force(20e3), "punch": travel(0)}), CUP[1]],
                {"symmetry": QUARTER}),
    "pouch": (AA5754, {"die": 0.12, "holder": 0.12, "punch": 0.05}, {},
              [("clamp", {"holder": force(6e3)}), ("draw", {"punch": travel(5)})], {"symmetry": QUARTER}),
}
# Elements around and up of tubes, inner radius, thickness and height.
TUBES = {"flare": (24, 40, 20, 1, 40), "nose": (24, 40, 20, 1, 40), "crush": (40, 4, 20, 1, 8)}
# Tools that the sheet's thickness direction does not tell the side of, those that go along no z, those that a stage before
# the last let go, and shape errors of tools with small radii [mm].
SIDES = {"flare": {"cone": "bottom"}, "nose": {"cone": "top"}, "hem": mu("pre flat", "top"), "crush": {"plate": "top"}}
DIRECTIONS = {"-x": [-1, 0, 0], "+z": [0, 0, 1], "-z": [0, 0, -1]}
GONE = {"redraw": "punch holder", "emboss": "punch holder die", "hem": "wipe die pre", "restrike": "die holder punch",
        "dimples": " ".join(BALLS[:-1])}
TOLERANCES = {"coin": 0.005, "clinch": 0.01, "joggle": 0.01, **mu("hem pouch restrike shrink", 0.03)}


def write(name, folder, programs, tol):
    folder.mkdir(parents=True, exist_ok=True)
    material, friction, shifts, stages, rest = SCENES[name]
    tools = []
    for tool, (solid, side) in solids(name).items():
        cq.exporters.export(solid, str(folder / f"{tool}.step"))
        subprocess.run(
            [programs / "kanagata", "convert", folder / f"{tool}.step", "--tol", str(TOLERANCES.get(name, tol)),
             "--sheet-side", side, "-o", folder / f"{tool}.tool.json"],
            check=True, capture_output=True,
        )
        entry = {"name": tool, "file": f"{tool}.tool.json", "direction": DIRECTIONS[side], "friction": friction[tool]}
        if tool in SIDES.get(name, {}):
            entry["side"] = SIDES[name][tool]
        if tool in shifts:
            shift = shifts[tool]
            entry["place"] = {"shift": shift if isinstance(shift, list) else [0, 0, shift]}
        tools.append(entry)
    stages = [{"name": stage, "drive": drive} for stage, drive in stages]
    there = [tool for tool in friction if tool not in GONE.get(name, "").split()]
    stages.append({"name": "free", "drive": {tool: RELEASE for tool in there}})
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
    print("| scene | unknowns | increments | iterations | cuts | snaps | energy | order | thinnest | processor [s] |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name in args.only or SCENES:
        path = write(name, args.folder / name, args.programs, args.tol)
        out = args.folder / name / "run"
        shutil.rmtree(out, ignore_errors=True)
        done = subprocess.run(
            [args.programs / "kanagata-solve", "run", path, "-o", out, "--overwrite", "--threads", "1"],
            capture_output=True, text=True,
        )
        if done.returncode != 0:
            print(f"| {name} | exit {done.returncode}: {done.stderr.strip()} |", flush=True)
            continue
        r = json.loads((out / "run.json").read_text())
        order, thickness = r.get("convergence_order"), r["thickness"]
        print(f"| {name} | {r['unknowns']} | {r['increments']} | {r['iterations']} | {r['step_cuts']} | {r['snap_throughs']} "
              f"| {r['energy_error']:.1e} | {order if order is None else round(order, 2)} "
              f"| {thickness['minimum_mm'] / thickness['initial_mm']:.3f} | {r['cpu_s']:.1f} |", flush=True)


if __name__ == "__main__":
    main()
