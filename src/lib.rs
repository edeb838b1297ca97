//! Kanagata turns the CAD of a forming die into smooth, audited tool models and forms sheet metal
//! against them with an implicit finite-element solver.
//!
//! The flow, one line a module (an import always points down this list, never up):
//!
//! - [`cli`]: one file a subcommand of the two programs
//! - [`prelude`]: the objects that other programs build on
//! - [`study`]: one scene in many variants
//! - [`run`]: a scene becomes a run folder
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

pub mod accuracy;
pub mod audit;
pub mod cad;
pub mod cancel;
#[cfg(feature = "cli")]
pub mod cli;
pub mod contact;
pub mod convert;
pub mod files;
pub mod geometry;
pub mod mesh;
pub mod prelude;
pub mod progress;
pub mod report;
pub mod run;
pub mod scene;
pub mod solver;
#[cfg(feature = "pages")]
pub mod study;
pub mod tool;

#[cfg(test)]
#[path = "../tests/skipping/mod.rs"]
mod skipping;
