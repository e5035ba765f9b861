//! PNG of 8-bit colours.
//!
//! Source: ISO/IEC 15948 (PNG), RFC 1950 (zlib).

use std::io::{self, Write};

use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};

use super::Image;

/// Writes an image as PNG.
///
/// # Errors
/// Those of the writer.
pub fn write_png(image: &Image, to: &mut dyn Write) -> io::Result<()> {
    to.write_all(b"\x89PNG\r\n\x1a\n")?;
    let [width, height] = image.size().map(|n| n as u32);
    let mut head = Vec::with_capacity(13);
    head.extend(width.to_be_bytes());
    head.extend(height.to_be_bytes());
    // 8 bits, red green blue, deflated, filtered, not interlaced
    head.extend([8, 2, 0, 0, 0]);
    chunk(to, *b"IHDR", &head)?;
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
    for row in image.rows() {
        // filter 1: each colour less the one to its left
        let left = std::iter::once(&[0; 3]).chain(row);
        let differences = row.iter().zip(left);
        let bytes = differences.flat_map(|(a, b)| (0..3).map(|i| a[i].wrapping_sub(b[i])));
        let line: Vec<u8> = std::iter::once(1).chain(bytes).collect();
        encoder.write_all(&line)?;
    }
    chunk(to, *b"IDAT", &encoder.finish()?)?;
    chunk(to, *b"IEND", &[])
}

fn chunk(to: &mut dyn Write, kind: [u8; 4], data: &[u8]) -> io::Result<()> {
    let mut sum = Crc::new();
    sum.update(&kind);
    sum.update(data);
    to.write_all(&(data.len() as u32).to_be_bytes())?;
    to.write_all(&kind)?;
    to.write_all(data)?;
    to.write_all(&sum.sum().to_be_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// The pixels of a file come back, and its parts have their sums.
    #[test]
    fn pixels_are_read_as_they_were_written() {
        let mut image = Image::new([3, 2], [255, 255, 255]);
        image.set([1, 1], [7, 200, 30]);
        let mut file = Vec::new();
        write_png(&image, &mut file).unwrap();
        let mut at = 8;
        let mut data = Vec::new();
        while at < file.len() {
            let length = u32::from_be_bytes(file[at..at + 4].try_into().unwrap()) as usize;
            let (kind, body) = (&file[at + 4..at + 8], &file[at + 8..at + 8 + length]);
            let mut sum = Crc::new();
            sum.update(&file[at + 4..at + 8 + length]);
            assert_eq!(
                file[at + 8 + length..at + 12 + length],
                sum.sum().to_be_bytes()
            );
            if kind == b"IDAT" {
                data.extend(body);
            }
            at += 12 + length;
        }
        let mut raw = Vec::new();
        flate2::read::ZlibDecoder::new(&data[..])
            .read_to_end(&mut raw)
            .unwrap();
        assert_eq!(raw.len(), 2 * (1 + 9));
        let line = &raw[11..];
        let pixel =
            |x: usize, c: usize| (0..=x).fold(0u8, |sum, i| sum.wrapping_add(line[3 * i + c]));
        assert_eq!([pixel(1, 0), pixel(1, 1), pixel(1, 2)], [7, 200, 30]);
        assert_eq!([pixel(2, 0), pixel(2, 1), pixel(2, 2)], [255; 3]);
    }
}
