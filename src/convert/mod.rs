//! CAD and mesh become a tool model: normals, creases, orientation.
