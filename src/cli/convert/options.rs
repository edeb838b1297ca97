//! Conversion options from the arguments.

use std::path::Path;

use super::args::{ConvertArgs, Edge, Kind};
use crate::cli::stages::progress;
use crate::convert::ConvertOptions;
use crate::files::standard::is_stdout;
use crate::reach::Reached;
use crate::tool::ToolKind;
use crate::tool::edge::EdgeRule;

/// Conversion options; `reached`: the reachable part of the model.
pub(super) fn options(args: &ConvertArgs, reached: Option<&Reached>) -> ConvertOptions {
    let (sheet_side, flip) = args.side_and_flip(reached);
    ConvertOptions {
        name: args.name.clone().unwrap_or_else(|| stem(&args.output)),
        kind: match args.how.kind {
            Kind::Nagata => ToolKind::Nagata,
            Kind::Facets => ToolKind::Facets,
            Kind::Bezier => ToolKind::Bezier,
        },
        edges: match args.edge() {
            Edge::Plain => EdgeRule::Plain,
            Edge::Guarded | Edge::Cad => EdgeRule::Guarded,
        },
        through_cad: args.edge() == Edge::Cad,
        smooth_deg: args.how.smooth_deg,
        sheet_side,
        flip,
        straighten: args.how.tol.is_some() || args.how.patches.is_some(),
        progress: progress(),
    }
}

/// File name without `.tool.json`; `tool` for standard output.
pub(super) fn stem(path: &Path) -> String {
    if is_stdout(path) {
        return "tool".into();
    }
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let stem = name.strip_suffix(".json").unwrap_or(&name);
    stem.strip_suffix(".tool").unwrap_or(stem).to_owned()
}
