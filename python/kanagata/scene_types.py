"""Types of a scene file; written by make_types.py from schemas/scene.schema.json."""

from typing import Any, Literal, NotRequired, TypedDict, Union


class Accuracy(TypedDict):
    """Errors allowed in the results: `kanagata-solve run` refines mesh, layers, points and increments until
    the estimated errors are below them. At least one is given; other quantities are reported with their
    estimates."""

    # Largest error of the displacement of the border in plan over its largest displacement, 0.0001 to 0.5.
    draw_in: NotRequired[Union[float, None]]
    # As `draw_in` [mm], above 0.
    draw_in_mm: NotRequired[Union[float, None]]
    # Error of the force of every tool whose travel is prescribed: root mean square over these stages, over
    # the largest force; 0.0001 to 0.5.
    force: NotRequired[Union[float, None]]
    # Error of the springback (largest and root mean square of the displacements) over the largest
    # displacement, 0.0001 to 0.5. A stage must release all tools.
    springback: NotRequired[Union[float, None]]
    # As `springback` [mm], above 0.
    springback_mm: NotRequired[Union[float, None]]
    # Error of the thickness over the initial thickness: of the minimum, and in the root mean square over the
    # sheet; 0.0001 to 0.5.
    thickness: NotRequired[Union[float, None]]


# A coordinate axis.
Axis = Union[Literal['x'], Literal['y'], Literal['z']]


class BackstressCard(TypedDict):
    """One backstress of Chaboche's law."""

    # Modulus C [MPa], >= 0.
    c_mpa: float
    # Recovery gamma, >= 0; 0 is linear (Prager's) hardening.
    gamma: float


class Blank(TypedDict):
    """The undeformed sheet: hexahedra in layers, with the thickness along z (for a mesh file: as in the
    file)."""

    # Element formulation.
    element: NotRequired["ElementKind"]
    # Elements through the thickness, >= 1. A file of hexahedra defines its own.
    layers: NotRequired[int]
    # Elements that are split in plan, for example over the radii of the tools.
    refine: NotRequired[list["Refine"]]
    # Rolling direction of a sheet of any orientation, in place of the angle: a vector that is projected on
    # the mid-surface of each element, at least 10 degrees from all element normals. Required for an
    # anisotropic material if the sheet is not normal to z. The third material axis is the normal of each
    # element.
    rolling_direction: NotRequired[Union[list[float], None]]
    # Angle about z from x to the rolling direction [degrees], for a sheet normal to z.
    rolling_direction_deg: NotRequired[float]
    # Outline and elements in plan.
    shape: "BlankShape"
    # Thickness [mm], > 0. Optional for a file of hexahedra, whose thickness is then their shortest dimension.
    # If given, it selects the thickness direction of a sheet that is narrower than thick.
    thickness_mm: NotRequired[float]
    # z of the lower face [mm]; for a mesh file a shift along z.
    z_mm: NotRequired[float]


class BlankShapeRectangleRectangle(TypedDict):
    """BlankShapeRectangleRectangle"""

    # Smallest x and y [mm].
    corner_mm: NotRequired[list[float]]
    # Elements along x and y, each >= 1.
    elements: list[int]
    # Size along x and y [mm], > 0.
    size_mm: list[float]


class BlankShapeRectangle(TypedDict):
    """A rectangle along x and y."""

    rectangle: "BlankShapeRectangleRectangle"


class BlankShapeQuarterDiscQuarterDisc(TypedDict):
    """BlankShapeQuarterDiscQuarterDisc"""

    # Elements along a side of the square core, >= 1; the rim has twice as many.
    core: int
    # Radius [mm], > 0.
    radius_mm: float
    # Elements from the core to the rim, >= 1.
    rings: int


class BlankShapeQuarterDisc(TypedDict):
    """The quarter `x, y >= 0` of a disc about the origin."""

    quarter_disc: "BlankShapeQuarterDiscQuarterDisc"


class BlankShapeDiscDisc(TypedDict):
    """BlankShapeDiscDisc"""

    # Elements along half a side of the square core, >= 1; the rim has eight times as many.
    core: int
    # Radius [mm], > 0.
    radius_mm: float
    # Elements from the core to the rim, >= 1.
    rings: int


class BlankShapeDisc(TypedDict):
    """A disc about the origin, of four quarter discs. It needs no symmetry planes, but friction or `holds`
    must prevent rigid-body motion in its plane."""

    disc: "BlankShapeDiscDisc"


class BlankShapeMeshMesh(TypedDict):
    """BlankShapeMeshMesh"""

    # Mesh file, relative to the scene.
    file: str
    # Treatment of strains, stresses and thicknesses in the file. A file with such fields is refused without
    # this key.
    state: NotRequired[Union["MeshState", None]]


class BlankShapeMesh(TypedDict):
    """A mesh file: hexahedra of .msh (2.2, 4.1), .vtu or an Abaqus deck (.inp: C3D8*, SC8R*) in any numbering
    and orientation, or quadrilaterals of these (S4*, M3D4*, CPS4*, CPE4*, CAX4*) and of .obj, which form the
    lower face."""

    mesh: "BlankShapeMeshMesh"


# Outline of a sheet and its elements in plan.
BlankShape = Union["BlankShapeRectangle", "BlankShapeQuarterDisc", "BlankShapeDisc", "BlankShapeMesh"]


class ContactMethodPenaltyPenalty(TypedDict):
    """ContactMethodPenaltyPenalty"""

    # Of the spring, over the mesh's, > 0.
    stiffness: float


class ContactMethodPenalty(TypedDict):
    """By a spring: the node lies in the tool by its normal force over the stiffness."""

    penalty: "ContactMethodPenaltyPenalty"


class ContactMethodAugmentedAugmented(TypedDict):
    """ContactMethodAugmentedAugmented"""

    # Of the spring, over the mesh's, > 0.
    stiffness: float


class ContactMethodAugmented(TypedDict):
    """By a spring about a known force, which is corrected from outside until the gap is closed."""

    augmented: "ContactMethodAugmentedAugmented"


# How a node is kept out of a tool. Stiffnesses are shares of the undeformed mesh's own, so that no unit
# enters.
ContactMethod = Union[Literal['exact'], "ContactMethodPenalty", "ContactMethodAugmented"]


# A travel [mm] or a force [N] over a stage. Either its value at the end, which is reached linearly from the
# value at the start, or a list of pairs `[fraction of the stage, value]` with linear interpolation. Fractions
# rise from 0 or above to 1. Without a pair at 0 the curve starts from the value at the start of the stage.
# Increments end at its corners. Forces are 0 or more, except behind a spring.
Course = Union[float, list[list[float]]]


class DriveTravelMm(TypedDict):
    """Travel along its direction since the start of the run [mm]."""

    travel_mm: "Course"


class DriveAdvanceMm(TypedDict):
    """Travel along its direction during this stage [mm]."""

    advance_mm: "Course"


class DriveForceN(TypedDict):
    """Force on the sheet along its direction, of the whole process (all symmetric parts together) [N]."""

    force_n: "Course"


class DriveSpring(TypedDict):
    """Supported by a spring."""

    spring: "Spring"


class DriveRelease(TypedDict):
    """Released (`true`). If another tool supports the sheet, the tool first retracts with the sheet over half
    of the stage while its force falls to a hundredth. The remaining forces fall to zero over the rest of the
    stage; then the tool is absent."""

    release: bool


class DriveAbsent(TypedDict):
    """Absent from this stage on, until a later stage drives it (`true`)."""

    absent: bool


# Drive of a tool during a stage.
Drive = Union["DriveTravelMm", "DriveAdvanceMm", "DriveForceN", "DriveSpring", "DriveRelease", "DriveAbsent"]


class ElementKindSolidShellSolidShell(TypedDict):
    """ElementKindSolidShellSolidShell"""

    # Whether the in-plane strains are assumed too, which a sheet that is drawn in needs. Without them a
    # coarse mesh is too stiff (a fifth in the force of a deep corner), and the rim of an expanded hole thins
    # too much (0.63 instead of 0.75 with 18 elements a quarter).
    membrane: NotRequired[bool]
    # Points through the thickness, 3 to 10. Even numbers are in two halves of the thickness with equal
    # weights, within 2 % of the bending moment; odd ones are Gauss-Legendre points, 1 to 14 % low.
    points: NotRequired[int]


# Solid-shell with 2 x 2 x `points` points: bends a thin sheet with one layer of elements.
ElementKindSolidShell = TypedDict(
    "ElementKindSolidShell",
    {
        "solid-shell": "ElementKindSolidShellSolidShell",
    },
)


# Which element formulation a body uses. A formulation with options may be named alone: `"solid-shell"`.
ElementKind = Union[Literal['hex8'], Literal['hex8-enhanced'], "ElementKindSolidShell", Literal['solid-shell']]


# The format tag of a scene file.
FormatTag = Literal['kanagata-scene']


class FormingLimit1(TypedDict):
    """Points of a measured curve, joined by straight lines in the diagram of logarithmic strains."""

    law: Literal['points']
    # Minor and major strain of each point, by strictly increasing minor strain; at least two, ratios and not
    # per cent.
    points: list[list[float]]
    # Strain measure of the points.
    strain: "StrainMeasure"


class FormingLimitLaw(TypedDict):
    """Keeler and Brazier (1977), for steels: plane-strain limit from thickness and strain-hardening
    exponent."""

    law: Literal['keeler-brazier']
    # Strain-hardening exponent n, above 0 and at most 1; default: n of the card's hardening law.
    n: NotRequired[Union[float, None]]


class FormingLimit3(TypedDict):
    """Abspoel, Scholting and Droog (2013), for steels: four points from elongation after fracture, r value
    and thickness."""

    # Smallest A80 of all directions [%], 1 to `a80_percent`; default: `a80_percent`.
    a80_min_percent: NotRequired[Union[float, None]]
    # Elongation after fracture A80, across the rolling direction [%], 1 to 100.
    a80_percent: float
    law: Literal['abspoel-scholting']
    # Mean r value `(r0 + 2 r45 + r90) / 4`, 0.1 to 5.
    r: float


# Forming limit curve of a sheet, measured or by a law.
FormingLimit = Union["FormingLimit1", "FormingLimitLaw", "FormingLimit3"]


class Hardening1(TypedDict):
    """`K (ε0 + p)^n`."""

    # `ε0`, above zero.
    eps0: float
    # `K` [MPa].
    k: float
    law: Literal['swift']
    # `n`, in [0, 1].
    n: float


class Hardening2(TypedDict):
    """`σ0 + Q (1 - exp(-b p))`."""

    # `b`, not below zero.
    b: float
    law: Literal['voce']
    # `Q` [MPa], not below zero.
    q: float
    # `σ0` [MPa].
    sigma0: float


class Hardening3(TypedDict):
    """`w K (ε0 + p)^n + (1 - w) (σ0 + Q (1 - exp(-b p)))`."""

    # `b`.
    b: float
    # `ε0`, above zero.
    eps0: float
    # `K` [MPa].
    k: float
    law: Literal['swift-voce']
    # `n`, in [0, 1].
    n: float
    # `Q` [MPa].
    q: float
    # `σ0` [MPa].
    sigma0: float
    # Share `w` of the Swift part, in [0, 1].
    weight: float


class Hardening4(TypedDict):
    """`σ0 + K p^n`."""

    # `K` [MPa].
    k: float
    law: Literal['ludwik']
    # `n`, in (0, 1].
    n: float
    # `σ0` [MPa].
    sigma0: float


class Hardening5(TypedDict):
    """Straight lines between points; constant after the last."""

    law: Literal['table']
    # Equivalent plastic strains, strictly increasing from 0.
    strain: list[float]
    # Flow stresses [MPa], not decreasing.
    stress: list[float]


# A hardening law. All laws must not soften; [`Hardening::check`] says whether the numbers allow that.
Hardening = Union["Hardening1", "Hardening2", "Hardening3", "Hardening4", "Hardening5"]


class Hold(TypedDict):
    """Nodes constrained at their initial position."""

    # Constrained directions.
    axes: list["Axis"]
    # The nodes.
    where: "Region"


class Load(TypedDict):
    """A constant force on nodes. It rises from zero over the first stage."""

    # Force of the whole process [N]. The modelled part, one of 2, 4 or 8 symmetric parts, carries the
    # corresponding fraction in any direction (a mirrored end is a second end). It is distributed uniformly
    # over the elements of these nodes, otherwise over their faces or edges.
    force_n: list[float]
    # The nodes.
    where: "Region"


# A sheet material.
MaterialCard = TypedDict(
    "MaterialCard",
    {
        # Chaboche backstresses.
        "backstresses": NotRequired[list["BackstressCard"]],
        # Forming limit curve; without one the margin to the limit is not judged.
        "forming_limit": NotRequired[Union["FormingLimit", None]],
        # Hardening law, in tension along the rolling direction; needed with `yield`.
        "hardening": NotRequired[Union["Hardening", None]],
        # Name.
        "name": str,
        # Poisson's ratio, in (-1, 0.5).
        "poisson": float,
        # Where the numbers come from.
        "source": NotRequired[str],
        # Yield criterion; without one the material is elastic.
        "yield": NotRequired[Union["YieldCriterion", None]],
        # Young's modulus [MPa], > 0.
        "young_mpa": float,
    },
)


# A material by name or as a card.
MaterialChoice = Union[str, "MaterialCard"]


# Treatment of the state in a mesh file with results.
MeshState = Literal['drop']


class Output(TypedDict):
    """Output of a run."""

    # Increments between checkpoints; 0: only when the run is stopped.
    checkpoint_every: NotRequired[int]
    # Sections of the sheet, with the angles and the curl of their walls before and after springback.
    sections: NotRequired[list["Section"]]
    # Increments between VTU files, which are also written at stage ends; 0: stage ends only.
    vtu_every: NotRequired[int]


class PlaceShift(TypedDict):
    """Position of the tool file, shifted by this vector [mm]."""

    shift: list[float]


# Initial position of a tool.
Place = Union[Literal['touch'], "PlaceShift"]


class PlanRegionAll(TypedDict):
    """All elements (`true`)."""

    all: bool


class PlanRegionBoxBox(TypedDict):
    """PlanRegionBoxBox"""

    # Largest x and y.
    max_mm: list[float]
    # Smallest x and y.
    min_mm: list[float]


class PlanRegionBox(TypedDict):
    """A box along x and y [mm]."""

    box: "PlanRegionBoxBox"


class PlanRegionBeyondRadiusMm(TypedDict):
    """Further than this from the z axis [mm]."""

    beyond_radius_mm: float


class PlanRegionRingRing(TypedDict):
    """PlanRegionRingRing"""

    # Its centre [mm].
    centre_mm: NotRequired[list[float]]
    # Inner and outer radius [mm]; an inner radius of 0 is a disc.
    radii_mm: list[float]


class PlanRegionRing(TypedDict):
    """A ring or a disc."""

    ring: "PlanRegionRingRing"


class PlanRegionPolygonMm(TypedDict):
    """A polygon by its corners [mm], 3 to 1000."""

    polygon_mm: list[list[float]]


# Elements of the undeformed blank in plan, seen along z: those that overlap the region.
PlanRegion = Union["PlanRegionAll", "PlanRegionBox", "PlanRegionBeyondRadiusMm", "PlanRegionRing", "PlanRegionPolygonMm"]


class Quality(TypedDict):
    """Limits of quality of the part. Each that is exceeded is a doubt, and the run ends with exit code 1."""

    # Smallest margin to the forming limit, at least 0 and below 1: 1 less the strain over the limit strain on
    # the straight path. The material card must have a `forming_limit`.
    flc_margin: NotRequired[Union[float, None]]
    # Largest displacement of a node in springback [mm], above 0. A stage must release all tools.
    max_springback_mm: NotRequired[Union[float, None]]
    # Largest thickening: increase of the thickness over the initial thickness, above 0.
    max_thickening: NotRequired[Union[float, None]]
    # Largest thinning: decrease of the thickness over the initial thickness, above 0 and below 1 (0.2 is 20
    # %).
    max_thinning: NotRequired[Union[float, None]]
    # Smallest thickness [mm], above 0.
    min_thickness_mm: NotRequired[Union[float, None]]


class Refine(TypedDict):
    """Elements of the blank that are split in plan: those of a region, or a level for each. An element of
    level `n` is split into `4^n` columns of elements through all layers. The largest level of all entries
    holds; it is raised where the levels of two elements with a common side would differ by more than 1."""

    # Level of the elements in the region: 1 to 4. Required with `where`.
    level: NotRequired[Union[int, None]]
    # In place of `level` and `where`: one digit from 0 to 4 for each element of the base mesh in plan, in its
    # order.
    levels: NotRequired[Union[str, None]]
    # Region in plan.
    where: NotRequired[Union["PlanRegion", None]]


class RegionAll(TypedDict):
    """All nodes (`true`)."""

    all: bool


class RegionPlane(TypedDict):
    """Nodes on a plane."""

    plane: "SymmetryPlane"


class RegionBeyondRadiusMm(TypedDict):
    """Nodes at least this far from the z axis [mm]."""

    beyond_radius_mm: float


class RegionBoxBox(TypedDict):
    """RegionBoxBox"""

    # Largest coordinates.
    max_mm: list[float]
    # Smallest coordinates.
    min_mm: list[float]


class RegionBox(TypedDict):
    """Nodes in a box [mm]."""

    box: "RegionBoxBox"


# Nodes of the undeformed sheet.
Region = Union["RegionAll", "RegionPlane", "RegionBeyondRadiusMm", "RegionBox"]


class Section(TypedDict):
    """A section: the material line in which a plane cuts the undeformed sheet."""

    # Coordinate of the plane along its normal [mm].
    at_mm: NotRequired[float]
    # Normal of the plane.
    normal: "SectionNormal"


# Normal of the plane of a section.
SectionNormal = Union[Literal['x'], Literal['y']]


# Surface of the sheet that a CAD file describes.
SheetSurface = Union[Literal['lower'], Literal['middle'], Literal['upper']]


# Faces of the sheet.
Side = Union[Literal['top'], Literal['bottom'], Literal['both']]


class SolverLimits(TypedDict):
    """Limits of the solver. The defaults suit ordinary sheet forming."""

    # Contact method: `exact`, or springs for comparison.
    contact: NotRequired["ContactMethod"]
    # Allowed residual force, as a fraction of the acting forces.
    force_tolerance: NotRequired[float]
    # Slip in an increment over which friction rises to the Coulomb limit, as a fraction of the longest
    # element edge. 0 separates stick from slip exactly, takes many times the iterations and may not converge;
    # 1e-8 is practically the same and as fast as the default.
    friction_transition: NotRequired[float]
    # Relative error of the forces from the length of an increment to be kept, 1e-4 to 0.5; estimated where
    # plastic flow and friction turn within an increment. By default the length of increments follows the
    # iterations alone.
    increment_error: NotRequired[Union[float, None]]
    # Largest number of increments of the run.
    increments: NotRequired[int]
    # `history.csv` of a run of the same stages, relative to the scene: increments end where its increments
    # ended. One that fails is cut, and the next ends there again. Stages without tools choose their own
    # increments.
    increments_of: NotRequired[Union[str, None]]
    # Newton iterations in an increment above which it is cut.
    iterations: NotRequired[int]
    # Smallest increment as a fraction of the first one; below it the run is reported as not converged.
    smallest_increment: NotRequired[float]
    # Target number of Newton iterations per increment: the step grows below it and shrinks above.
    wanted_iterations: NotRequired[int]


class Spring(TypedDict):
    """A spring behind a tool, of the whole process. It pushes along the tool's direction with `force_n -
    stiffness_n_per_mm * travel`. The travel is along that direction since the start of the run; a tool pushed
    back has a negative one."""

    # Force at zero travel [N]. It starts from the value that balances the tool's force at the start of the
    # stage, unless an equal spring supports the tool already.
    force_n: NotRequired["Course"]
    # Stiffness [N/mm], > 0.
    stiffness_n_per_mm: float


class Stage(TypedDict):
    """A stage: each tool is driven by travel or by force, starting from its current travel or force. A tool
    that is not named keeps its travel or its force."""

    # Drive of each tool by name, one each.
    drive: NotRequired[dict[str, Any]]
    # First increment as a fraction of the stage, in (0, 1]; default 0.05.
    first_increment: NotRequired[Union[float, None]]
    # Largest increment as a fraction of the stage, in (0, 1]; default 0.1, or the first increment if that is
    # larger.
    largest_increment: NotRequired[Union[float, None]]
    # Fraction of `loads` at the end of the stage; default 1.
    load_share: NotRequired[Union[float, None]]
    # Name, used in the history.
    name: str


# Measure of given strains.
StrainMeasure = Union[Literal['engineering'], Literal['logarithmic']]


class SymmetryPlane(TypedDict):
    """A symmetry plane normal to a coordinate axis. The blank lies on one side; nodes on the plane remain on
    it."""

    # Coordinate of the plane on that axis [mm].
    at_mm: NotRequired[float]
    # Axis normal to the plane.
    normal: "Axis"


class Tool(TypedDict):
    """A rigid tool."""

    # CAD from which the tool file is made where it is missing or was made otherwise (`kanagata run`).
    cad: NotRequired[Union["ToolCad", None]]
    # Positive direction of its travel and of its force on the sheet; need not be a unit vector.
    direction: list[float]
    # Tool file, relative to the scene.
    file: str
    # Coulomb friction coefficient with the sheet, 0 to 10. If it is not given, 0 is used and a doubt is
    # raised.
    friction: NotRequired[Union[float, None]]
    # Name: up to 64 letters, digits, `-` and `_`; used for columns of `history.csv`.
    name: str
    # Initial position.
    place: NotRequired["Place"]
    # Face of the sheet that it may touch. Default: from its direction and the thickness direction of the
    # sheet (mean of its columns, upwards). A direction against the thickness direction gives the top, one
    # along it the bottom. Required if the two are nearly perpendicular.
    side: NotRequired[Union["Side", None]]
    # Limit of the travel under force or spring control since the start of the run [mm], >= 0: distance
    # blocks, or the end of a cylinder. It does not push a tool back from its position at the start of a
    # stage, and does not limit prescribed travel.
    stop_mm: NotRequired[Union[float, None]]


class ToolCad(TypedDict):
    """CAD of a tool, from which `kanagata run` makes the tool file. The solver alone does not read it."""

    # Bodies of the file that make the tool: numbers from 1, or names with `*` and `?`. Default: all. An item
    # that begins with `!` excludes, here and below; faces that all given lists choose are taken.
    bodies: NotRequired[list[str]]
    # Colours: `#rrggbb`, a name such as `red`, or `none`.
    colours: NotRequired[list[str]]
    # Faces: numbers from 0, ranges as `3-9`, entities as `#120` or `D25`, or names with `*` and `?`.
    faces: NotRequired[list[str]]
    # IGES or STEP file, relative to the scene.
    file: str
    # Reverses the normals after they are turned towards the sheet, against the direction of the tool.
    flip: NotRequired[bool]
    # Layers and groups, by names with `*` and `?`.
    layers: NotRequired[list[str]]
    # Offset of the surface [mm] along its normals that look at the sheet, before `flip`: the thickness and
    # `flip` make the punch of a die.
    offset_mm: NotRequired[Union[float, None]]
    # The CAD is this surface of the sheet, not of the tool. The tool is offset by the thickness of the blank,
    # or half of it.
    sheet_surface: NotRequired[Union["SheetSurface", None]]
    # Largest shape error (Eq. 24) [mm], 1e-6 or above. The tool has the fewest patches found within it.
    tol_mm: NotRequired[float]


class YieldCriterionCriterion(TypedDict):
    """Von Mises."""

    criterion: Literal['von-mises']


class YieldCriterion2(TypedDict):
    """Hill 1948 by its parameters; scaled to `G + H = 1`."""

    criterion: Literal['hill48']
    # F; sums of two of F, G and H, and F G + G H + H F, are > 0.
    f: float
    # G
    g: float
    # H
    h: float
    # L (shear yz), > 0.
    l: float
    # M (shear zx), > 0.
    m: float
    # N (shear xy), > 0.
    n: float


class YieldCriterion3(TypedDict):
    """Hill 1948 by its r values; L = M = 1.5."""

    criterion: Literal['hill48-r']
    # r along the rolling direction, > 0.
    r0: float
    # r at 45 degrees, >= 0.
    r45: float
    # r across it, > 0.
    r90: float


class YieldCriterion4(TypedDict):
    """Hosford's isotropic non-quadratic function."""

    criterion: Literal['hosford']
    # Exponent, in [2, 60]: 8 for face-centred, 6 for body-centred cubic metals.
    exponent: float


class YieldCriterion5(TypedDict):
    """Yld2004-18p; scaled to tension along the rolling direction."""

    criterion: Literal['yld2004-18p']
    # Exponent, in [2, 60].
    exponent: float
    # c'12, c'13, c'21, c'23, c'31, c'32, c'44 (shear yz), c'55 (zx), c'66 (xy).
    first: list[float]
    # c''12, c''13, c''21, c''23, c''31, c''32, c''44, c''55, c''66.
    second: list[float]


# A yield criterion.
YieldCriterion = Union["YieldCriterionCriterion", "YieldCriterion2", "YieldCriterion3", "YieldCriterion4", "YieldCriterion5"]


class SceneFile(TypedDict):
    """A forming process: sheet, material, tools and stages."""

    # Errors that a sequence of runs may leave in the results.
    accuracy: NotRequired[Union["Accuracy", None]]
    # The sheet.
    blank: "Blank"
    # `kanagata-scene`.
    format: "FormatTag"
    # Constrained nodes.
    holds: NotRequired[list["Hold"]]
    # Nodal forces.
    loads: NotRequired[list["Load"]]
    # Material of the sheet: name of a card in the library, a card file (`"./steel.json"`), or a complete
    # card.
    material: "MaterialChoice"
    # Name, for reports.
    name: str
    # Output files.
    output: NotRequired["Output"]
    # Limits of quality of the part. Each that is exceeded is a doubt, and the run ends with exit code 1.
    quality: NotRequired[Union["Quality", None]]
    # Limits of the solver.
    solver: NotRequired["SolverLimits"]
    # Stages in order.
    stages: list["Stage"]
    # Symmetry planes of the modelled part.
    symmetry: NotRequired[list["SymmetryPlane"]]
    # Rigid tools.
    tools: list["Tool"]
    # File version: 1.
    version: int
