//! Binary arrays of VTK's XML files: a length, or the lengths of compressed blocks, followed by numbers.

use std::borrow::Cow;
use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

/// Encoding of the arrays of a file.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Encoding {
    /// Big-endian lengths and numbers.
    pub big_endian: bool,
    /// Lengths of eight bytes instead of four.
    pub wide_lengths: bool,
    /// Numbers in blocks compressed by zlib.
    pub zlib: bool,
}

/// The data from the start of an array; other arrays may follow.
pub(super) enum Source<'a> {
    /// Base64 text. Each part (lengths, data) may be padded by `=`.
    Base64(&'a [u8]),
    /// Raw bytes.
    Raw(&'a [u8]),
}

impl Source<'_> {
    /// The first `count` bytes.
    ///
    /// # Errors
    /// Fewer bytes than `count`, or invalid base64.
    fn take(&self, count: usize) -> Result<Cow<'_, [u8]>, String> {
        let ends = |found: usize| format!("{found} bytes of an array of {count} or more");
        match self {
            Source::Raw(data) => {
                data.get(..count).map(Cow::Borrowed).ok_or_else(|| ends(data.len()))
            }
            Source::Base64(text) => {
                let mut text = *text;
                let mut bytes = Vec::new();
                while bytes.len() < count {
                    if text.is_empty() {
                        return Err(ends(bytes.len()));
                    }
                    let padding = text.iter().position(|&c| c == b'=').unwrap_or(text.len());
                    let behind = text[padding..].iter().take_while(|&&c| c == b'=').count();
                    let wanted = (count - bytes.len()).div_ceil(3).saturating_mul(4);
                    let (part, rest) = text.split_at((padding + behind).min(wanted));
                    STANDARD.decode_vec(part, &mut bytes).map_err(|e| e.to_string())?;
                    text = rest;
                }
                bytes.truncate(count);
                Ok(Cow::Owned(bytes))
            }
        }
    }
}

impl Encoding {
    /// The numbers of an array of VTK's type `kind`, at most `max_values`.
    ///
    /// # Errors
    /// An unknown type, an array that ends early, more than `max_values` numbers, or corrupt data.
    pub fn numbers(
        self,
        source: &Source<'_>,
        kind: &str,
        max_values: usize,
    ) -> Result<Vec<f64>, String> {
        let width = match kind {
            "Float64" | "Int64" | "UInt64" => 8,
            "Float32" | "Int32" | "UInt32" => 4,
            "UInt8" | "Int8" => 1,
            other => return Err(format!("numbers of type '{other}'")),
        };
        let data = self.data(source, max_values.saturating_mul(width))?;
        let numbers = |size: usize, convert: &dyn Fn([u8; 8]) -> f64| -> Vec<f64> {
            data.chunks_exact(size)
                .map(|chunk| {
                    let mut bytes = [0u8; 8];
                    bytes[..size].copy_from_slice(chunk);
                    if self.big_endian {
                        bytes[..size].reverse();
                    }
                    convert(bytes)
                })
                .collect()
        };
        let low4 = |b: [u8; 8]| [b[0], b[1], b[2], b[3]];
        Ok(match kind {
            "Float64" => numbers(8, &f64::from_le_bytes),
            "Float32" => numbers(4, &|b| f64::from(f32::from_le_bytes(low4(b)))),
            "Int64" => numbers(8, &|b| i64::from_le_bytes(b) as f64),
            "UInt64" => numbers(8, &|b| u64::from_le_bytes(b) as f64),
            "Int32" => numbers(4, &|b| f64::from(i32::from_le_bytes(low4(b)))),
            "UInt32" => numbers(4, &|b| f64::from(u32::from_le_bytes(low4(b)))),
            "UInt8" => numbers(1, &|b| f64::from(b[0])),
            _ => numbers(1, &|b| f64::from(b[0] as i8)),
        })
    }

    /// The bytes of an array, at most `max_bytes`.
    ///
    /// Layout: `[bytes][data]`, or `[blocks][uncompressed bytes of a block][of the last block][compressed bytes of
    /// each][blocks]`.
    fn data(self, source: &Source<'_>, max_bytes: usize) -> Result<Vec<u8>, String> {
        let word = if self.wide_lengths { 8 } else { 4 };
        let too_long = || "an array longer than the file".to_owned();
        let first = self.length(&source.take(word)?, 0);
        let too_many = || format!("more than {max_bytes} bytes, the limit for a file of this size");
        if !self.zlib {
            let end = first.checked_add(word).ok_or_else(too_long)?;
            let data = source.take(end)?;
            return if first > max_bytes { Err(too_many()) } else { Ok(data[word..].to_vec()) };
        }
        if first == 0 {
            return Ok(Vec::new());
        }
        let head = first.checked_add(3).and_then(|n| n.checked_mul(word)).ok_or_else(too_long)?;
        let lengths = source.take(head)?;
        let ends = self.block_ends(&lengths, (head, first)).ok_or_else(too_long)?;
        let compressed = source.take(ends[first])?;
        let block = self.length(&lengths, 1);
        let mut data = Vec::new();
        for (k, bounds) in ends.windows(2).enumerate() {
            let before = data.len();
            let part = ZlibDecoder::new(&compressed[bounds[0]..bounds[1]]);
            let limit = block.min(max_bytes - before);
            let read = part.take((limit as u64).saturating_add(1)).read_to_end(&mut data);
            read.map_err(|e| format!("block {k} of compressed data: {e}"))?;
            let found = data.len() - before;
            if data.len() > max_bytes {
                return Err(too_many());
            }
            if found > block || (k + 1 < first && found < block) {
                return Err(format!(
                    "{found} bytes in block {k} of compressed data, {block} declared"
                ));
            }
        }
        Ok(data)
    }

    /// Offsets at which `blocks` compressed blocks behind a head of `head` bytes end, the head first; `None` if they exceed
    /// the address space.
    fn block_ends(self, lengths: &[u8], (head, blocks): (usize, usize)) -> Option<Vec<usize>> {
        let mut ends = vec![head];
        for k in 3..3 + blocks {
            ends.push(ends[k - 3].checked_add(self.length(lengths, k))?);
        }
        Some(ends)
    }

    /// The k-th length; `usize::MAX` if it exceeds the address space.
    fn length(self, bytes: &[u8], k: usize) -> usize {
        let word = if self.wide_lengths { 8 } else { 4 };
        let mut wide = [0u8; 8];
        wide[..word].copy_from_slice(&bytes[k * word..(k + 1) * word]);
        if self.big_endian {
            wide[..word].reverse();
        }
        usize::try_from(u64::from_le_bytes(wide)).unwrap_or(usize::MAX)
    }
}
