//! What a run is: blank, material, tools, stages, output; read and checked.
