//! Time collections (`.pvd`): the parts of a model at every step, for ParaView and PyVista.

use std::path::Path;

use super::foreign::escaped;
use kanagata_files::{WriteError, write_atomic};

/// A part of the model at a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part<'a> {
    /// Name of its block.
    pub name: &'a str,
    /// File, relative to the collection.
    pub file: &'a str,
}

/// Writes a collection: time and parts of every step, in order. Part k has the number k at every step.
///
/// # Errors
/// [`WriteError`] when the folder is missing or full.
pub fn write_pvd(path: &Path, steps: &[(f64, Vec<Part<'_>>)]) -> Result<(), WriteError> {
    write_atomic(path, |out| {
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        writeln!(
            out,
            "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>"
        )?;
        for (time, parts) in steps {
            for (k, Part { name, file }) in parts.iter().enumerate() {
                let (name, file) = (escaped(name), escaped(file));
                writeln!(
                    out,
                    "<DataSet timestep=\"{time}\" group=\"\" part=\"{k}\" name=\"{name}\" file=\"{file}\"/>"
                )?;
            }
        }
        writeln!(out, "</Collection>\n</VTKFile>")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collection_lists_its_steps_and_parts_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        let part = |name, file| Part { name, file };
        let first = vec![part("sheet", "steps/0.vtu"), part("die", "tools/die.vtu")];
        write_pvd(&path, &[(0.0, first), (0.25, vec![part("sheet", "steps/a&b.vtu")])]).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        let lines: Vec<&str> = text.lines().filter(|line| line.starts_with("<DataSet")).collect();
        assert_eq!(
            lines,
            [
                "<DataSet timestep=\"0\" group=\"\" part=\"0\" name=\"sheet\" file=\"steps/0.vtu\"/>",
                "<DataSet timestep=\"0\" group=\"\" part=\"1\" name=\"die\" file=\"tools/die.vtu\"/>",
                "<DataSet timestep=\"0.25\" group=\"\" part=\"0\" name=\"sheet\" file=\"steps/a&amp;b.vtu\"/>"
            ]
        );
    }
}
