//! 3-D views on pages: surfaces with fields, at several steps. A picture made here stands in the page; the script of the page
//! puts a view drawn by WebGL2 in its place.

mod arrays;
mod colors;
mod description;
mod figure;
mod picture;
mod png;
mod surface;
mod view;

pub(super) use arrays::Arrays;
pub use surface::{Field, Frame, Location, Surface, Visibility, connected, fans};
pub use view::View;
