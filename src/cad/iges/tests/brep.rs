//! Tests of the side of its loops on which a face of a solid (186) lies, with solids that have curved pockets.

use std::f64::consts::PI;

use super::build::{Item, file, item, moved};
use super::*;
use crate::build::build;
use crate::{Model, Severity};

/// A solid as it is filled: entities, edges and faces of the shell with their orientation flags.
struct Solid {
    items: Vec<Item>,
    edges: Vec<String>,
    shell: Vec<String>,
}

/// Pointer of the vertex list.
const VERTICES: usize = 7;
/// Pointer of the edge list.
const EDGES: usize = 5;

impl Solid {
    fn new(vertices: &[[f64; 3]]) -> Self {
        let points: Vec<String> =
            vertices.iter().map(|[x, y, z]| format!("{x:?},{y:?},{z:?}")).collect();
        let vertices = item(502, 1, format!("{},{}", points.len(), points.join(",")));
        let items = vec![item(186, 0, "3,1,0"), item(514, 1, ""), item(504, 1, ""), vertices];
        Self { items, edges: Vec::new(), shell: Vec::new() }
    }

    fn add(&mut self, added: Item) -> usize {
        self.items.push(added);
        2 * self.items.len() - 1
    }

    fn edge(&mut self, curve: Item, [from, to]: [usize; 2]) {
        let curve = self.add(curve);
        self.edges.push(format!("{curve},{VERTICES},{from},{VERTICES},{to}"));
    }

    /// A face on the surface with this pointer: edges from 1, negative against their direction, and parameter curves.
    fn face(&mut self, surface: usize, along: bool, uses: &[(i32, Option<&str>)]) {
        let mut edges = Vec::new();
        for (edge, flat) in uses {
            let flat = flat.map(|line| self.add(item(110, 0, line)));
            let flat = flat.map_or("0".to_owned(), |f| format!("1,0,{f}"));
            edges.push(format!("0,{EDGES},{},{},{flat}", edge.abs(), i32::from(*edge > 0)));
        }
        let boundary = self.add(item(508, 1, format!("{},{}", edges.len(), edges.join(","))));
        let face = self.add(item(510, 1, format!("{surface},1,1,{boundary}")));
        self.shell.push(format!("{face},{}", i32::from(along)));
    }

    /// Centre, axis and reference direction: pointers for an analytic surface.
    fn axes(&mut self, [centre, axis, reference]: [&str; 3]) -> [usize; 3] {
        let centre = self.add(item(116, 0, format!("{centre},0")));
        [centre, self.add(item(123, 0, axis)), self.add(item(123, 0, reference))]
    }

    fn plane(&mut self, axes: [&str; 3], along: bool, edges: &[i32]) {
        let [point, normal, reference] = self.axes(axes);
        let plane = self.add(item(190, 1, format!("{point},{normal},{reference}")));
        let uses: Vec<_> = edges.iter().map(|&e| (e, None)).collect();
        self.face(plane, along, &uses);
    }

    fn bytes(mut self) -> Vec<u8> {
        self.items[1].text = format!("{},{}", self.shell.len(), self.shell.join(","));
        self.items[2].text = format!("{},{}", self.edges.len(), self.edges.join(","));
        file(&self.items)
    }
}

const X: &str = "1.,0.,0.";
const Y: &str = "0.,1.,0.";
const Z: &str = "0.,0.,1.";
/// Matrices (124) that turn x, y, z into y, z, x and into z, x, y.
const TURNS: [&str; 2] =
    ["0.,0.,1.,0.,1.,0.,0.,0.,0.,1.,0.,0.", "0.,1.,0.,0.,0.,0.,1.,0.,1.,0.,0.,0."];

/// Vertices of a cube of side 4 with a corner cut off by a ball of radius 2.
const CUT_CORNER_VERTICES: [[f64; 3]; 10] = [
    [2., 0., 0.],
    [0., 2., 0.],
    [0., 0., 2.],
    [4., 0., 0.],
    [0., 4., 0.],
    [0., 0., 4.],
    [4., 4., 0.],
    [0., 4., 4.],
    [4., 0., 4.],
    [4., 4., 4.],
];
/// Its straight edges, between vertices numbered from 1.
const CUT_CORNER_LINES: [[usize; 2]; 12] = [
    [1, 4],
    [2, 5],
    [3, 6],
    [4, 7],
    [7, 5],
    [5, 8],
    [8, 6],
    [6, 9],
    [9, 4],
    [7, 10],
    [8, 10],
    [9, 10],
];

/// A cube of side 4 with a corner cut off by a ball of radius 2: the surface normals of the ball and of the three planes
/// through its centre point into the material. `ball`: edges of the face on the ball.
fn cut_corner(ball: [i32; 3]) -> Vec<u8> {
    let vertices = CUT_CORNER_VERTICES;
    let mut solid = Solid::new(&vertices);
    let turns = TURNS.map(|t| u32::try_from(solid.add(item(124, 0, t))).unwrap());
    for (k, ends) in [[1, 2], [2, 3], [3, 1]].into_iter().enumerate() {
        let matrix = k.checked_sub(1).map_or(0, |k| turns[k]);
        solid.edge(moved(100, 0, matrix, "0.,0.,0.,2.,0.,0.,2."), ends);
    }
    for [a, b] in CUT_CORNER_LINES {
        let [p, q] = [a, b].map(|k: usize| vertices[k - 1].map(|x| format!("{x:?}")).join(","));
        solid.edge(item(110, 0, format!("{p},{q}")), [a, b]);
    }
    let [centre, axis, reference] = solid.axes(["0.,0.,0.", Z, X]);
    let sphere = solid.add(item(196, 1, format!("{centre},2.,{axis},{reference}")));
    solid.face(sphere, false, &ball.map(|e| (e, None)));
    solid.plane(["0.,0.,0.", Z, X], false, &[4, 7, 8, -5, -1]);
    solid.plane(["0.,0.,0.", X, Y], false, &[5, 9, 10, -6, -2]);
    solid.plane(["0.,0.,0.", Y, Z], false, &[6, 11, 12, -4, -3]);
    solid.plane(["0.,0.,4.", Z, X], true, &[11, 15, -14, 10]);
    solid.plane(["4.,0.,0.", X, Y], true, &[7, 13, -15, 12]);
    solid.plane(["0.,4.,0.", Y, Z], true, &[9, 14, -13, 8]);
    solid.bytes()
}

fn area(model: &Model) -> f64 {
    model.faces.iter().map(|f| f.area(1e-9)).sum()
}

#[test]
fn a_pocket_of_a_ball_is_the_part_inside_its_loop() {
    let bytes = cut_corner([1, 2, 3]);
    let file = File::open(&bytes);
    for scale in [1.0, -1.0] {
        let faces = Reader::new(&file).walk(scale).unwrap().faces;
        let (model, diagnostics) = build(RawModel { faces, ..RawModel::default() }, "cut corner");
        assert!(diagnostics.is_empty(), "scale {scale}: {diagnostics:?}");
        assert!(model.edges.iter().all(|e| e.uses.len() == 2), "scale {scale}");
        assert!((area(&model) - (96.0 - PI)).abs() < 1e-6, "scale {scale}: {}", area(&model));
        let ball = &model.faces[0];
        let corner = ball.loops[0].uses[0].pcurve.points()[0];
        let normal = ball.surface.normal(corner).unwrap() * if ball.flipped { -1.0 } else { 1.0 };
        assert!(normal.dot(&ball.surface.point(corner)) < -1.9, "scale {scale}");
    }
}

#[test]
fn a_loop_against_its_shell_on_a_closed_surface_is_doubted() {
    let (model, diagnostics) =
        build(read_bytes(&cut_corner([-3, -2, -1]), "test").unwrap(), "the other part of the ball");
    assert!((area(&model) - (96.0 - 3.0 * PI + 14.0 * PI)).abs() < 1e-5, "{}", area(&model));
    let doubts: Vec<_> = diagnostics.iter().filter(|d| d.code == "side-doubtful").collect();
    assert_eq!(doubts.len(), 1, "{diagnostics:?}");
    assert_eq!(doubts[0].severity, Severity::Warning);
    assert_eq!(doubts[0].place, model.faces[0].source);
}

/// A quarter of a ring about z, of the tube a quarter too: radii 5 and 1. Its parameter curves run along the tube first,
/// and about the axis in the negative sense.
fn fillet() -> Vec<u8> {
    let mut solid = Solid::new(&[[6., 0., 0.], [0., 6., 0.], [0., 5., 1.], [5., 0., 1.]]);
    let upright = "1.,0.,0.,0.,0.,0.,-1.,0.,0.,1.,0.,0.";
    let [a, b] = [upright, TURNS[0]].map(|t| u32::try_from(solid.add(item(124, 0, t))).unwrap());
    let tube = "0.,5.,0.,6.,0.,5.,1.";
    solid.edge(item(100, 0, "0.,0.,0.,6.,0.,0.,6."), [1, 2]);
    solid.edge(moved(100, 0, b, tube), [2, 3]);
    solid.edge(item(100, 0, "1.,0.,0.,5.,0.,0.,5."), [4, 3]);
    solid.edge(moved(100, 0, a, tube), [1, 4]);
    let [centre, axis, reference] = solid.axes(["0.,0.,0.", Z, X]);
    let torus = solid.add(item(198, 1, format!("{centre},{axis},5.,1.,{reference}")));
    let uses = [
        (1, Some("0.,360.,0.,0.,270.,0.")),
        (2, Some("0.,270.,0.,90.,270.,0.")),
        (-3, Some("90.,270.,0.,90.,360.,0.")),
        (-4, Some("90.,360.,0.,0.,360.,0.")),
    ];
    solid.face(torus, false, &uses);
    solid.bytes()
}

#[test]
fn parameter_curves_along_the_tube_first_are_accepted() {
    let raw = read_bytes(&fillet(), "test").unwrap();
    let codes: Vec<_> = raw.diagnostics.iter().map(|d| d.code).collect();
    assert_eq!(codes, ["parameters-other"]);
    let edges = &raw.faces[0].loops[0].edges;
    for edge in edges {
        let (flat, curve) = (edge.pcurve.as_ref().unwrap(), edge.curve.as_ref().unwrap());
        for k in 0..=4 {
            let at = |[a, b]: [f64; 2]| a + (b - a) * f64::from(k) / 4.0;
            let on = point_on(&raw.faces[0].surface, flat.point(at(flat.domain()))).unwrap();
            assert!(curve.closest(&on).1.sqrt() < 1e-9, "{on:?}");
        }
    }
    let (model, _) = build(raw, "fillet");
    let expected = 0.5 * PI * (2.5 * PI + 1.0);
    assert!((area(&model) - expected).abs() < 1e-8, "{}", area(&model));
}
