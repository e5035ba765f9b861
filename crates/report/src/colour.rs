//! Colour maps of scalar fields, as 17 stops that the viewer and the legend interpolate.
//!
//! Sources: viridis (van der Walt and Smith 2015, CC0); the diverging map of Moreland 2009, "Diverging Color
//! Maps for Scientific Visualization".

/// Which colours a scalar takes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ColourMap {
    /// From low to high, equal steps look equal, readable without colour vision: viridis.
    #[default]
    Sequential,
    /// Two directions from a neutral middle, for errors about zero: Moreland's blue to red.
    Diverging,
}

/// Stops at equal intervals from the low to the high end, sRGB.
pub type Stops = [[u8; 3]; 17];

const VIRIDIS: Stops = [
    [68, 1, 84],
    [72, 24, 106],
    [71, 45, 123],
    [66, 64, 134],
    [59, 82, 139],
    [51, 99, 141],
    [44, 114, 142],
    [38, 130, 142],
    [33, 145, 140],
    [31, 160, 136],
    [40, 174, 128],
    [63, 188, 115],
    [94, 201, 98],
    [132, 212, 75],
    [173, 220, 48],
    [216, 226, 25],
    [253, 231, 37],
];

const BLUE_TO_RED: Stops = [
    [59, 76, 192],
    [78, 104, 216],
    [98, 130, 234],
    [119, 154, 247],
    [141, 176, 254],
    [163, 194, 254],
    [185, 208, 249],
    [204, 217, 237],
    [221, 220, 220],
    [236, 211, 197],
    [245, 196, 172],
    [247, 176, 147],
    [244, 152, 122],
    [235, 125, 98],
    [221, 95, 75],
    [202, 59, 55],
    [180, 4, 38],
];

impl ColourMap {
    /// The stops of this map.
    pub fn stops(self) -> &'static Stops {
        match self {
            ColourMap::Sequential => &VIRIDIS,
            ColourMap::Diverging => &BLUE_TO_RED,
        }
    }
}
