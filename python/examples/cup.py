"""From the CAD of two tools to a hemispherical cup: convert, audit, check, run, look at the thickness."""

import sys
from pathlib import Path
from typing import Literal

import kanagata


def main(root: Path, out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    tools: list[tuple[str, Literal["+z", "-z"], str]] = [
        ("die", "+z", "round_die_144.igs"),
        ("punch", "-z", "hemi_punch_144.igs"),
    ]
    for name, side, file in tools:
        cad = kanagata.read_cad(root / "fixtures/forming" / file)
        tool = cad.convert(name=name, tol_mm=0.02, sheet_side=side)
        error = kanagata.audit(tool, cad, tol_mm=0.02)
        print(f"{name}: {cad.faces} faces, {tool.patches} patches, shape error {error.worst_mm:.4f} mm")
        tool.write(out / f"{name}.tool.json")

    text = (root / "fixtures/dome/dome.scene.json").read_text()
    (out / "cup.scene.json").write_text(text)
    scene = kanagata.Scene(out / "cup.scene.json")
    for finding in scene.check().findings:
        print(f"{finding['level']}: {finding['what']}")

    def show(progress: kanagata.Progress) -> None:
        print(f"\r{progress['done']:4.0%}  punch {progress['force_n']['punch'] / 1e3:8.3f} kN", end="")

    run = scene.run(out / "run", on_increment=show)
    print(f"\n{run}")
    print(f"least thickness {run.metrics['thickness_min_mm']:.4f} mm, thinning {run.metrics['thinning_max']:.1%}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
