//! Work of a search, counted: patches evaluated and cells of closest-point searches.

use std::path::Path;

use super::*;
use crate::normals::vertex_normals;
use crate::searches::{SearchLimits, Searches};
use kanagata_geometry::Vec3;
use kanagata_mesh::mapped::mesh;

fn read(file: &str) -> Model {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("fixtures/forming")
        .join(file);
    kanagata_cad::read(&path).unwrap().0
}

/// Patches evaluated for `tol_mm`, and patches of the result.
fn work(model: &Model, tol_mm: f64) -> (u64, usize) {
    let (reference, neighbours) = (CadReference::new(model), Neighbours::new(model));
    let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
    let borders = Borders::Conforming;
    let goal = Goal { tol_mm, normal_deg: f64::INFINITY, two_sided: true, borders };
    let mesh = MappedOptions::default();
    let scope = Scope::new(model, &reference, &mesh, &options, Some(&neighbours), false).unwrap();
    let found = searched(&scope, &goal).unwrap();
    (scope.budget.total(), found.tool.patches.len())
}

/// Growth takes most of the work: what lowering, exchange and complete models add is in proportion to it.
#[test]
fn a_die_takes_few_evaluated_patches_for_each_of_its_result() {
    let model = read("cross_die_144.igs");
    for (tol_mm, patches_max, ratio_max) in [(0.05, 43, WORK_RATIO), (0.01, 65, WORK_RATIO)] {
        let (evaluated, patches) = work(&model, tol_mm);
        println!("{tol_mm} mm: {evaluated} evaluated patches, {patches} patches");
        assert!(patches <= patches_max, "{tol_mm}: {patches}");
        assert!(evaluated <= ratio_max * patches as u64, "{tol_mm}: {evaluated}");
    }
}

/// Evaluated patches for each patch of a result.
const WORK_RATIO: u64 = 200;

/// Vertices 1e-7 mm off their faces, as in files of ten digits far from the origin: no surface is searched as a whole.
#[test]
fn vertices_beside_their_faces_need_no_search_of_the_surface() {
    let mut model = read("cross_die_nurbs144.igs");
    model.join_tolerance = model.join_tolerance.max(1e-6);
    let options = MappedOptions { arc_divisions: 3, ..MappedOptions::default() };
    let mut mesh = mesh(&model, &options).unwrap();
    let off = |x: &Vec3| Vec3::new(x.y.sin(), x.z.sin(), x.x.sin()) * 1e-7;
    mesh.vertices.iter_mut().for_each(|x| *x += off(x));
    let cells = |mesh: &kanagata_mesh::SurfaceMesh| {
        let searches = Searches::new(&model, mesh, SearchLimits::NAGATA);
        let table = vertex_normals(&model, mesh, 0.0, &searches).unwrap();
        assert!(table.ids.len() == mesh.elements.len());
        searches.cells()
    };
    let known = cells(&mesh);
    mesh.feet = Default::default();
    let unknown = cells(&mesh);
    println!("{known} cells with known parameters, {unknown} without");
    assert!(known == 0 && unknown > mesh.vertices.len() as u64, "{known} {unknown}");
}
