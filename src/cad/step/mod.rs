//! STEP part 21 (AP203, AP214, AP242).

use super::CadError;
use super::raw::RawModel;

/// Parses the bytes of a STEP file; `name` is used in messages.
///
/// # Errors
/// [`CadError::Invalid`] with `#id` or line when the text is beyond repair.
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<RawModel, CadError> {
    let _ = (bytes, name);
    unimplemented!("cad: STEP")
}
