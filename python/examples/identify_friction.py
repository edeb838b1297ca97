"""Friction from a curve of force over travel: a golden-section search, one run a trial. The curve is that of a known friction."""

import sys
from pathlib import Path

import numpy as np

import kanagata

TRUE_FRICTION = 0.12
TRAVELS_MM = np.linspace(2.0, 12.0, 21)


def force_curve(scene_file: Path, folder: Path, friction: float) -> np.ndarray:
    """Force of the punch [N] at TRAVELS_MM."""
    names = ("die", "holder", "punch")
    scene = kanagata.Scene(scene_file, set={f"tools.{name}.friction": friction for name in names})
    columns = scene.run(folder, overwrite=True).arrays()
    drawn = columns["stage"] == "draw"
    return np.asarray(np.interp(TRAVELS_MM, columns["punch_travel_mm"][drawn], columns["punch_force_n"][drawn]))


def main(root: Path, out: Path) -> None:
    scene_file = root / "examples/strip/strip.scene.json"
    measured = force_curve(scene_file, out / "measured", TRUE_FRICTION)
    trials: dict[float, float] = {}

    def misfit(friction: float) -> float:
        if friction not in trials:
            difference = force_curve(scene_file, out / "trial", friction) - measured
            trials[friction] = float(np.sqrt(np.mean(difference**2) / np.mean(measured**2)))
            print(f"friction {friction:.4f}: misfit {trials[friction]:.4f}")
        return trials[friction]

    golden = (5**0.5 - 1) / 2
    low, high = 0.05, 0.25
    for _ in range(10):
        left, right = high - golden * (high - low), low + golden * (high - low)
        low, high = (low, right) if misfit(left) < misfit(right) else (left, high)
    best = min(trials, key=lambda friction: trials[friction])
    print(f"friction {best:.4f}, that of the curve {TRUE_FRICTION}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
