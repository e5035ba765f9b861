//! Still pictures of things in space: drawn here, written as PNG.

pub mod draw;
mod png;
pub mod text;

pub use png::write_png;

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
