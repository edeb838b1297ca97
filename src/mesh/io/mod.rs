//! Mesh files. Written: MSH 4.1 and VTU. Read: MSH 2.2 and 4.1 (ASCII, binary), STL, OBJ and VTU; all others through
//! Python's meshio if installed.

mod abaqus;
pub(super) mod cursor;
mod mesh_file;
mod meshio;
mod msh_read;
mod msh_write;
mod named;
mod obj;
mod polygon;
mod read;
mod sheet;
mod stl;
mod tags;
#[cfg(test)]
mod tests;
mod volumes;
mod vtu;
mod write;

pub use mesh_file::{CornerNormals, MeshFile, UNATTACHED};
pub use named::is_mesh;
pub use read::{parse, read, read_file, read_unchecked};
pub use sheet::{parse_sheet, read_sheet};
pub use volumes::{SheetElements, SheetMesh};
pub use vtu::grid as to_vtu;
pub use write::write;
