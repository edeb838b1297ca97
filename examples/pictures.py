#!/usr/bin/env python3
"""Pictures of a run and of audited tools with PyVista, without a window.

  python examples/pictures.py sheet RUN PICTURE.png [--mirror x]   the last step: thinning of the sheet, tools behind y = 0
  python examples/pictures.py tools PICTURE.png AUDIT.vtu ...      tools coloured by their shape error

RUN is a run folder; AUDIT.vtu is written by `kanagata audit --vtu`. Needs PyVista and Pillow: `pip install pyvista pillow`.
"""

import argparse
import pathlib

import numpy
import pyvista
import vtk
from PIL import Image

WIDTH, HEIGHT = 900, 560


def blocks_of_last_step(run):
    """The blocks of the last step of a run by their names, the sheet first."""
    reader = pyvista.get_reader(str(run / "run.pvd"))
    reader.set_active_time_value(reader.time_values[-1])
    files = {data.part: pathlib.Path(data.path) for data in reader.active_datasets}
    blocks = dict(zip(sorted(files), (pyvista.read(run / files[part]) for part in sorted(files))))
    names = ["sheet"] + [name.removesuffix("_travel_mm") for name in blocks[0].field_data.keys() if name.endswith("_travel_mm")]
    return {names[part]: block for part, block in blocks.items()}


def scene():
    vtk.vtkMapper.SetResolveCoincidentTopologyToPolygonOffset()
    plotter = pyvista.Plotter(off_screen=True, window_size=(WIDTH, HEIGHT))
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def bar(title):
    return dict(title=title + "\n", color="black", vertical=True, position_x=0.86, position_y=0.15, height=0.65, width=0.05,
                fmt="%.3g", title_font_size=17, label_font_size=15, n_labels=5)


def save(plotter, path):
    """Writes the picture with 256 colours, so that it stays small."""
    picture = Image.fromarray(plotter.screenshot(return_img=True))
    picture.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


def surface(grid):
    return grid.extract_surface(algorithm="dataset_surface", pass_cellid=False, pass_pointid=False)


def free_edges(grid):
    faces = grid if isinstance(grid, pyvista.PolyData) else surface(grid)
    return faces.extract_feature_edges(feature_edges=False, manifold_edges=False, non_manifold_edges=False)


def sheet(run, path, mirror):
    blocks = blocks_of_last_step(run)
    plotter = scene()
    formed = [surface(blocks.pop("sheet"))]
    for axis in mirror:
        formed += [part.reflect(numpy.eye(3)["xyz".index(axis)]) for part in formed]
    for part in formed:
        plotter.add_mesh(part, scalars="thinning_percent", cmap="turbo", show_edges=True, edge_color="#606060", line_width=0.5,
                         ambient=0.3, scalar_bar_args=bar("thinning [%]"))
    for tool in blocks.values():
        # Patches share no points: merged, only the border of the tool is a free edge.
        behind = surface(tool).clean(tolerance=1e-3, absolute=True).clip(normal="y", origin=(0.0, 0.0, 0.0), invert=False)
        plotter.add_mesh(behind, color="#8a98a5", opacity=0.18, ambient=0.3)
        plotter.add_mesh(free_edges(behind), color="#606060", line_width=1.0)
    plotter.camera_position = [(0.25, -1.0, 0.55), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(1.45)
    save(plotter, path)


def tools(path, audits):
    grids = [pyvista.read(audit) for audit in audits]
    limit = max(numpy.nanmax(numpy.abs(grid["shape_error_mm"])) for grid in grids)
    plotter = scene()
    right = 0.0
    for grid in grids:
        low, high = grid.bounds[:2]
        moved = grid.translate((right - low, 0.0, 0.0))
        right += (high - low) * 1.1
        plotter.add_mesh(moved, scalars="shape_error_mm", cmap="coolwarm", clim=(-limit, limit), nan_color="#d0d0d0",
                         ambient=0.5, scalar_bar_args=bar("shape error [mm]"))
        # Patches share no points: their borders are free edges.
        plotter.add_mesh(free_edges(moved), color="#404040", line_width=1.5)
    plotter.camera_position = [(0.2, -1.0, 0.9), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(1.4)
    # Room for the scale on the right.
    plotter.camera.SetWindowCenter(0.14, 0.0)
    save(plotter, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    of_sheet = commands.add_parser("sheet")
    of_sheet.add_argument("run", type=pathlib.Path)
    of_sheet.add_argument("picture", type=pathlib.Path)
    of_sheet.add_argument("--mirror", default="", help="symmetry planes through the origin: x, y or xy")
    of_tools = commands.add_parser("tools")
    of_tools.add_argument("picture", type=pathlib.Path)
    of_tools.add_argument("audits", type=pathlib.Path, nargs="+")
    arguments = parser.parse_args()
    if arguments.command == "sheet":
        sheet(arguments.run, arguments.picture, arguments.mirror)
    else:
        tools(arguments.picture, arguments.audits)


if __name__ == "__main__":
    main()
