"""Springback of a U-channel: angle and curl of its wall by the program, and the angle by a line through the nodes of the sheet."""

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
    changes = {"output.vtu_every": 1, "output.sections": [{"normal": "y", "at_mm": 0.5}]}
    run = kanagata.Scene(root / "examples/strip/strip.scene.json", set=changes).run(out / "run")
    columns = run.arrays()
    travel, force = columns["punch_travel_mm"], columns["punch_force_n"]
    drawn = int(np.flatnonzero(columns["stage"] == "draw")[-1])
    print(f"{run}: {force[drawn]:.1f} N at {travel[drawn]:.1f} mm")
    wall = run.record["sections"][0]["walls"][0]
    opened = wall["released_wall_deg"] - wall["wall_deg"]
    print(f"corner {wall['wall_deg']:.2f} degrees with the tools, {wall['released_wall_deg']:.2f} without: {opened:+.2f}")
    print(f"curl radius {wall['curl_radius_mm'] or math.inf:.1f} mm")
    loaded = max(k for k, (time, _) in enumerate(run.steps) if time <= 2.0)
    before, after = wall_angle(run.mesh(loaded)), wall_angle(run.mesh(-1))
    print(f"by lines through nodes the wall leans by {before:.2f} degrees before, {after:.2f} after")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
