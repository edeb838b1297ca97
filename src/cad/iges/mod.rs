//! IGES 5.3, fixed ASCII form.

use super::CadError;
use super::raw::RawModel;

/// Parses the bytes of an IGES file; `name` is used in messages.
///
/// # Errors
/// [`CadError::Invalid`] with line and card when the text is beyond repair.
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<RawModel, CadError> {
    let _ = (bytes, name);
    unimplemented!("cad: IGES")
}
