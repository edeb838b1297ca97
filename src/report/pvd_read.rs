//! Reader of `.pvd` collections: time, part and file of every data set.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// One data set of a collection.
#[derive(Debug, Clone, PartialEq)]
pub struct PvdEntry {
    /// Time.
    pub time: f64,
    /// Part; 0 where the collection names none.
    pub part: usize,
    /// File, relative to the collection.
    pub file: String,
}

/// The data sets of a collection, in its order.
///
/// # Errors
/// What was found in place of a collection or a time.
pub fn parse_pvd(text: &str) -> Result<Vec<PvdEntry>, String> {
    let mut reader = Reader::from_str(text);
    let mut entries = Vec::new();
    let mut is_collection = false;
    loop {
        match reader.read_event() {
            Ok(Event::Empty(tag) | Event::Start(tag)) => match tag.name().as_ref() {
                b"Collection" => is_collection = true,
                b"DataSet" => entries.push(entry(&tag)?),
                _ => {}
            },
            Ok(Event::Eof) if is_collection => return Ok(entries),
            Ok(Event::Eof) => return Err("no Collection; allowed: a collection of VTK".into()),
            Ok(_) => {}
            Err(error) => return Err(error.to_string()),
        }
    }
}

fn entry(tag: &BytesStart<'_>) -> Result<PvdEntry, String> {
    let value = |name: &str| {
        let attribute = tag.try_get_attribute(name).map_err(|e| e.to_string())?;
        attribute.map(|a| a.unescape_value().map_err(|e| e.to_string())).transpose()
    };
    let file = value("file")?.ok_or("a DataSet without a file")?.into_owned();
    let time = value("timestep")?.map_or(Ok(0.0), |text| text.parse::<f64>());
    let time = time.map_err(|_| format!("DataSet {file}: its timestep is no number"))?;
    let part = value("part")?.map_or(Ok(0), |text| text.parse::<usize>());
    let part = part.map_err(|_| format!("DataSet {file}: its part is no number"))?;
    Ok(PvdEntry { time, part, file })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::{Input, read_text};
    use crate::report::write_pvd;

    #[test]
    fn what_was_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        let steps = [(0.0, "steps/0.vtu".to_owned()), (0.25, "steps/a&b.vtu".to_owned())];
        write_pvd(&path, &steps).unwrap();
        let read = parse_pvd(&read_text(&path, Input::Description).unwrap()).unwrap();
        let read: Vec<(f64, String)> = read.into_iter().map(|e| (e.time, e.file)).collect();
        assert_eq!(read, steps);
    }

    #[test]
    fn other_files_and_broken_ones_are_refused() {
        for text in [
            "",
            "<VTKFile/>",
            "<VTKFile><Collection>",
            "<Collection><DataSet/></Collection>",
            "<Collection><DataSet file=\"a\" timestep=\"x\"/></Collection>",
            "<Collection><DataSet file=\"a\" part=\"-1\"/></Collection>",
        ] {
            let found = parse_pvd(text);
            let is_empty_collection = text == "<VTKFile><Collection>";
            assert_eq!(found.is_err(), !is_empty_collection, "{text}: {found:?}");
        }
    }
}
