"""Angle of the wall of a U-channel after its tools are released, from the nodes of the sheet, and its force over travel."""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

import kanagata


def wall_angle(mesh: Any) -> float:
    """Angle of the straight wall to the vertical [degrees], by a line through the nodes at half its height."""
    points = np.asarray(mesh.points)
    low, high = points[:, 2].min(), points[:, 2].max()
    middle = np.abs(points[:, 2] - 0.5 * (low + high)) < 0.2 * (high - low)
    centred = points[middle][:, [0, 2]] - points[middle][:, [0, 2]].mean(axis=0)
    direction = np.linalg.svd(centred)[2][0]
    return math.degrees(math.atan2(abs(direction[0]), abs(direction[1])))


def main(root: Path, out: Path) -> None:
    scene = kanagata.Scene(root / "examples/strip/strip.scene.json", set={"output.vtu_every": 1})
    run = scene.run(out / "run")
    columns = run.arrays()
    travel, force = columns["punch_travel_mm"], columns["punch_force_n"]
    stage = columns["stage"]
    drawn = int(np.flatnonzero(stage == "draw")[-1])
    print(f"{run}: {force[drawn]:.1f} N at {travel[drawn]:.1f} mm")
    loaded = max(k for k, (time, _) in enumerate(run.steps) if time <= 2.0)
    before, after = wall_angle(run.mesh(loaded)), wall_angle(run.mesh(-1))
    print(f"wall {before:.2f} degrees from the vertical with the tools, {after:.2f} without: {after - before:+.2f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
