"""Shape error over the number of patches, for Nagata patches, those with edges on the CAD, and facets, as a table and a chart."""

import csv
import sys
from pathlib import Path
from typing import Any, Literal

import kanagata


def main(root: Path, out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    cad = kanagata.read_cad(root / "fixtures/forming/hemi_punch_144.igs")
    rows: list[dict[str, Any]] = []
    kinds: list[tuple[Literal["nagata", "facets"], bool]] = [("nagata", False), ("nagata", True), ("facets", False)]
    for kind, edges_on_cad in kinds:
        for divisions in (1, 2, 4, 8):
            tool = cad.convert(kind=kind, edges_on_cad=edges_on_cad, arc_divisions=divisions)
            error = kanagata.audit(tool, cad)
            name = kind + (" on CAD" if edges_on_cad else "")
            rows.append({"kind": name, "patches": tool.patches, "error_mm": error.worst_mm, "normal_deg": error.normal_max_deg})
            print(f"{name:14} {tool.patches:6} patches  {error.worst_mm:.3e} mm  {error.normal_max_deg:6.3f} degrees")
    with open(out / "errors.csv", "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, rows[0].keys())
        table.writeheader()
        table.writerows(rows)
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return
    figure = Figure(figsize=(6, 4))
    axes = figure.subplots()
    for name in dict.fromkeys(row["kind"] for row in rows):
        mine = [row for row in rows if row["kind"] == name]
        axes.loglog([r["patches"] for r in mine], [r["error_mm"] for r in mine], "o-", label=str(name))
    axes.set(xlabel="patches", ylabel="shape error [mm]")
    axes.legend()
    figure.savefig(str(out / "errors.svg"))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
