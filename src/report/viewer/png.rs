//! PNG files with a palette (ISO/IEC 15948).

use std::io::Write as _;

use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};

/// A PNG of one palette index per pixel, row by row; index 0 is transparent. `palette` has 1 to 256 colours.
pub(super) fn png([width, height]: [usize; 2], pixels: &[u8], palette: &[[u8; 3]]) -> Vec<u8> {
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut head = Vec::new();
    head.extend((width as u32).to_be_bytes());
    head.extend((height as u32).to_be_bytes());
    // Depth 8, palette, zlib, adaptive filters, not interlaced.
    head.extend([8, 3, 0, 0, 0]);
    chunk(&mut out, b"IHDR", &head);
    chunk(&mut out, b"PLTE", palette.as_flattened());
    chunk(&mut out, b"tRNS", &[0]);
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    for row in pixels.chunks(width.max(1)) {
        // Filter 0 before each row. Writing to memory does not fail.
        let _ = encoder.write_all(&[0]).and_then(|()| encoder.write_all(row));
    }
    chunk(&mut out, b"IDAT", &encoder.finish().unwrap_or_default());
    chunk(&mut out, b"IEND", &[]);
    out
}

fn chunk(out: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    out.extend((data.len() as u32).to_be_bytes());
    let mut crc = Crc::new();
    for part in [&kind[..], data] {
        crc.update(part);
        out.extend(part);
    }
    out.extend(crc.sum().to_be_bytes());
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    #[test]
    fn chunks_hold_the_pixels_and_their_sums() {
        let file = png([2, 2], &[0, 1, 1, 0], &[[0; 3], [255, 0, 7]]);
        assert!(file.starts_with(b"\x89PNG\r\n\x1a\n"));
        let mut at = 8;
        let mut kinds = Vec::new();
        while at < file.len() {
            let length = u32::from_be_bytes(file[at..at + 4].try_into().unwrap()) as usize;
            let data = &file[at + 8..at + 8 + length];
            let kind = String::from_utf8_lossy(&file[at + 4..at + 8]).into_owned();
            let mut crc = Crc::new();
            crc.update(&file[at + 4..at + 8 + length]);
            let sum =
                u32::from_be_bytes(file[at + 8 + length..at + 12 + length].try_into().unwrap());
            assert_eq!(crc.sum(), sum, "{kind}");
            if kind == "IDAT" {
                let mut rows = Vec::new();
                flate2::read::ZlibDecoder::new(data).read_to_end(&mut rows).unwrap();
                assert_eq!(rows, [0, 0, 1, 0, 1, 0]);
            }
            kinds.push(kind);
            at += 12 + length;
        }
        assert_eq!(kinds, ["IHDR", "PLTE", "tRNS", "IDAT", "IEND"]);
    }
}
