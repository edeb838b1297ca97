//! Kanagata turns the CAD of a forming die into smooth, audited tool models and forms sheet metal
//! against them with an implicit finite-element solver.
//!
//! The flow, one line a module (an import always points down this list, never up):
//!
//! - [`cli`]: one file a subcommand of the two programs
//! - [`prelude`]: the objects that other programs build on
//! - [`study`]: one scene in many variants
//! - [`run`]: a scene becomes a run folder
//! - [`reach`]: faces of a CAD model that a sheet comes near
//! - [`convert`]: CAD and mesh become a tool model; [`scene`]: what a run is
//! - [`audit`]: the shape error of a tool model against its CAD (Eq. 24); [`solver`]: the forming solver
//! - [`mesh`]: surface meshes of a CAD model; [`report`]: what people look at; [`contact`]: closest point on a tool
//! - [`cad`]: IGES and STEP become trimmed NURBS faces; [`tool`]: Nagata and Bezier patches and the tool file
//! - [`geometry`]: vectors, boxes, NURBS; [`files`]: reading and writing whole files; [`cancel`]: requests to stop; [`progress`]: how far
//!   an operation is
//!
//! Everything inside is in mm, N, MPa, s and rad; units are converted where a file is read.
//! `contact` and `solver` know tool files only: they never see `cad`, `mesh`, `convert` or `audit`.
//!
//! # Features
//!
//! | feature | adds | dependencies |
//! |---|---|---|
//! | `cli` (default; implies `pages`) | [`cli`], both programs | clap, indicatif, signal-hook |
//! | `pages` | charts and HTML pages of [`report`], `audit::page`, `run::report`, [`study`] | plotters |
//!
//! With `default-features = false` the library reads CAD, meshes, converts, audits and runs scenes. Run folders then hold all
//! files but `report.html`.

#[cfg(feature = "cli")]
pub mod cli;
pub mod prelude;

#[doc(inline)]
pub use kanagata_accuracy as accuracy;
#[doc(inline)]
pub use kanagata_audit as audit;
#[doc(inline)]
pub use kanagata_cad as cad;
#[doc(inline)]
pub use kanagata_cancel as cancel;
#[doc(inline)]
pub use kanagata_contact as contact;
#[doc(inline)]
pub use kanagata_convert as convert;
#[doc(inline)]
pub use kanagata_files as files;
#[doc(inline)]
pub use kanagata_geometry as geometry;
#[doc(inline)]
pub use kanagata_mesh as mesh;
#[doc(inline)]
pub use kanagata_progress as progress;
#[doc(inline)]
pub use kanagata_reach as reach;
#[doc(inline)]
pub use kanagata_report as report;
#[doc(inline)]
pub use kanagata_run as run;
#[doc(inline)]
pub use kanagata_scene as scene;
#[doc(inline)]
pub use kanagata_solver as solver;
#[cfg(feature = "pages")]
#[doc(inline)]
pub use kanagata_study as study;
#[doc(inline)]
pub use kanagata_tool as tool;

#[cfg(test)]
#[allow(dead_code)] // Some of these shapes are for the tests of other modules.
#[path = "cad/query_tests/shapes.rs"]
mod shapes;
