"""CAD of forming dies to smooth, audited tool models, and implicit sheet-forming simulations.

Lengths are in mm, forces in N, stresses in MPa, angles in degrees, times in s. Arrays are those of NumPy.

    import kanagata

    cad = kanagata.read_cad("die.igs")
    die = cad.convert(name="die", tol_mm=0.01, sheet_side="+z")
    print(die, die.audit(cad))
    die.write("die.tool.json")
    run = kanagata.run("cup.scene.json", "out", on_increment=lambda p: print(f"{p['done']:.0%}"))
    print(run.verdict, run.metrics["thickness_min_mm"])
"""

from ._kanagata import (
    Audit,
    Cad,
    ConvergenceError,
    InputError,
    KanagataError,
    Material,
    StoppedError,
    Tool,
    __version__,
    materials,
)
from .programs import program
from .results import Run
from .scenes import Accuracy, Check, Progress, Scene, run, run_to_accuracy
from .tools import (
    Closest,
    MadeTool,
    audit,
    closest,
    convert,
    make_tools,
    material,
    mesh_of,
    read_cad,
    read_tool,
)

__all__ = [
    "Accuracy",
    "Audit",
    "Cad",
    "Check",
    "Closest",
    "ConvergenceError",
    "InputError",
    "KanagataError",
    "MadeTool",
    "Material",
    "Progress",
    "Run",
    "Scene",
    "StoppedError",
    "Tool",
    "__version__",
    "audit",
    "closest",
    "convert",
    "make_tools",
    "material",
    "materials",
    "mesh_of",
    "program",
    "read_cad",
    "read_tool",
    "run",
    "run_to_accuracy",
]
