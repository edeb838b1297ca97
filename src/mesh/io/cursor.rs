//! Cursor over a mesh file with numbers as text or raw bytes.

use crate::MeshError;

/// Reads numbers from text or binary data, never beyond the end.
pub struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    file: &'a str,
    /// Numbers are raw bytes.
    pub binary: bool,
    /// Raw numbers have the opposite byte order.
    pub swapped: bool,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8], file: &'a str) -> Self {
        Self { bytes, at: 0, file, binary: false, swapped: false }
    }

    /// An error at the current position: line number in text, byte in binary files.
    pub fn error(&self, found: impl Into<String>, allowed: impl Into<String>) -> MeshError {
        let place = if self.binary {
            format!("byte {}", self.at)
        } else {
            // After a line has been read the position is behind its end.
            let before = &self.bytes[..self.at.min(self.bytes.len()).saturating_sub(1)];
            format!("line {}", before.iter().filter(|&&b| b == b'\n').count() + 1)
        };
        MeshError::Invalid {
            file: self.file.into(),
            place,
            found: found.into(),
            allowed: allowed.into(),
        }
    }

    /// Name of the file, for messages.
    pub fn file(&self) -> &'a str {
        self.file
    }

    /// Skips white space and `mark`, which must follow.
    pub fn expect(&mut self, mark: &[u8]) -> Result<(), MeshError> {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        if !rest.starts_with(mark) {
            let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len()).min(40);
            let found = format!("'{}'", String::from_utf8_lossy(&rest[..length]).trim());
            self.at += 1;
            let allowed = format!("{}: as many entries as declared", String::from_utf8_lossy(mark));
            return Err(self.error(found, allowed));
        }
        self.at += mark.len();
        Ok(())
    }

    pub fn at_end(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// The next line without its line end; `None` at the end of the file.
    pub fn line(&mut self) -> Option<&'a str> {
        if self.at_end() {
            return None;
        }
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        Some(std::str::from_utf8(&rest[..length]).unwrap_or("").trim())
    }

    /// Skips to the end of the next occurrence of `mark`, or to the end of the file.
    pub fn skip_past(&mut self, mark: &[u8]) {
        let found = self.bytes[self.at..].windows(mark.len().max(1)).position(|w| w == mark);
        self.at = found.map_or(self.bytes.len(), |k| self.at + k + mark.len());
    }

    /// The next word of text.
    pub fn word(&mut self) -> Result<&'a str, MeshError> {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.error("the end of the file", "a number"));
        }
        let word = std::str::from_utf8(&rest[..length]);
        let word = word.map_err(|_| self.error("bytes that are not text", "a number"))?;
        self.at += length;
        Ok(word)
    }

    fn parsed<T: std::str::FromStr>(&mut self, allowed: &str) -> Result<T, MeshError> {
        let word = self.word()?;
        word.parse().map_err(|_| {
            let short: String = word.chars().take(40).collect();
            self.error(format!("'{short}'"), allowed)
        })
    }

    fn raw<const N: usize>(&mut self) -> Result<[u8; N], MeshError> {
        let taken = self.bytes.get(self.at..self.at + N).and_then(|b| <[u8; N]>::try_from(b).ok());
        let mut out =
            taken.ok_or_else(|| self.error("the end of the file", format!("{N} more bytes")))?;
        self.at += N;
        if self.swapped {
            out.reverse();
        }
        Ok(out)
    }

    /// A four-byte integer, or a word.
    pub fn int(&mut self) -> Result<i64, MeshError> {
        if self.binary {
            Ok(i64::from(i32::from_le_bytes(self.raw()?)))
        } else {
            self.parsed("a whole number")
        }
    }

    /// An eight-byte count or tag, or a word.
    pub fn size(&mut self) -> Result<u64, MeshError> {
        if self.binary {
            Ok(u64::from_le_bytes(self.raw()?))
        } else {
            self.parsed("a whole number, 0 or more")
        }
    }

    /// An eight-byte real, or a word; finite.
    pub fn float(&mut self) -> Result<f64, MeshError> {
        let x: f64 =
            if self.binary { f64::from_le_bytes(self.raw()?) } else { self.parsed("a number")? };
        if x.is_finite() { Ok(x) } else { Err(self.error(x.to_string(), "a finite number")) }
    }

    /// A four-byte real (binary STL).
    pub fn float4(&mut self) -> Result<f64, MeshError> {
        let x = f64::from(f32::from_le_bytes(self.raw()?));
        if x.is_finite() { Ok(x) } else { Err(self.error(x.to_string(), "a finite number")) }
    }

    /// Skips `count` bytes.
    pub fn skip(&mut self, count: usize) {
        self.at = self.at.saturating_add(count).min(self.bytes.len());
    }
}
