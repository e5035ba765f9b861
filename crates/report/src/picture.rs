//! Still pictures of things in space: drawn here, written as PNG.

pub mod draw;
pub mod text;

use std::io::{self, Write};

/// Red, green and blue of every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    size: [usize; 2],
    pixels: Vec<[u8; 3]>,
}

impl Image {
    /// An image of so many pixels across and down, all of one colour.
    pub fn new(size: [usize; 2], colour: [u8; 3]) -> Self {
        Image {
            size,
            pixels: vec![colour; size[0] * size[1]],
        }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Its rows from the top.
    pub fn rows(&self) -> impl Iterator<Item = &[[u8; 3]]> {
        self.pixels.chunks(self.size[0].max(1))
    }

    /// Colours a pixel; nothing outside.
    pub fn set(&mut self, [x, y]: [usize; 2], colour: [u8; 3]) {
        if x < self.size[0]
            && let Some(pixel) = self.pixels.get_mut(y * self.size[0] + x)
        {
            *pixel = colour;
        }
    }
}

/// Writes an image as PNG.
///
/// # Errors
/// Those of the writer; an image without pixels.
pub fn write_png(image: &Image, to: &mut dyn Write) -> io::Result<()> {
    let [width, height] = image.size.map(|n| n as u32);
    let mut encoder = png::Encoder::new(to, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(image.pixels.as_flattened())?;
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_read_as_they_were_written() {
        let mut image = Image::new([3, 2], [255, 255, 255]);
        image.set([1, 1], [7, 200, 30]);
        image.set([3, 0], [0; 3]);
        let mut file = Vec::new();
        write_png(&image, &mut file).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(file))
            .read_info()
            .unwrap();
        let mut pixels = [0; 18];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, image.pixels.as_flattened());
        assert_eq!(pixels[12..15], [7, 200, 30]);
        assert!(write_png(&Image::new([0, 3], [0; 3]), &mut Vec::new()).is_err());
    }
}
