//! Arrays of a VTK XML file and the appended section that holds their bytes.

use std::io::{self, Write};

use meltpath_geometry::math::DVec3;

use crate::escape::escape;

/// Values of an array, borrowed from their owner.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a> {
    /// 32-bit floats.
    Float32(&'a [f32]),
    /// 64-bit floats.
    Float64(&'a [f64]),
    /// 64-bit integers.
    Int64(&'a [i64]),
    /// Bytes, such as classes.
    UInt8(&'a [u8]),
    /// Triples of 64-bit floats.
    Points(&'a [DVec3]),
}

impl Values<'_> {
    fn vtk_type(&self) -> &'static str {
        match self {
            Values::Float32(_) => "Float32",
            Values::Float64(_) | Values::Points(_) => "Float64",
            Values::Int64(_) => "Int64",
            Values::UInt8(_) => "UInt8",
        }
    }

    fn components(&self) -> usize {
        if matches!(self, Values::Points(_)) {
            3
        } else {
            1
        }
    }

    fn bytes(&self) -> u64 {
        let bytes = match self {
            Values::Float32(v) => 4 * v.len(),
            Values::Float64(v) => 8 * v.len(),
            Values::Int64(v) => 8 * v.len(),
            Values::UInt8(v) => v.len(),
            Values::Points(v) => 24 * v.len(),
        };
        bytes as u64
    }

    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Values::Float32(v) => v.iter().try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Values::Float64(v) => v.iter().try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Values::Int64(v) => v.iter().try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Values::UInt8(v) => out.write_all(v),
            Values::Points(v) => v
                .iter()
                .flat_map(DVec3::to_array)
                .try_for_each(|x| out.write_all(&x.to_le_bytes())),
        }
    }
}

/// A file under construction: the XML so far and the arrays that will follow it.
pub(super) struct Document<'a> {
    xml: String,
    arrays: Vec<Values<'a>>,
    offset: u64,
    kind: &'static str,
}

impl<'a> Document<'a> {
    /// Begins a file of a VTK kind such as `PolyData`.
    pub(super) fn new(kind: &'static str) -> Self {
        let xml = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
        );
        Document {
            xml,
            arrays: Vec::new(),
            offset: 0,
            kind,
        }
    }

    /// Adds XML as it stands.
    pub(super) fn xml(&mut self, text: &str) {
        self.xml.push_str(text);
        self.xml.push('\n');
    }

    /// Adds an array; its bytes come after the XML.
    pub(super) fn array(&mut self, name: &str, values: Values<'a>) {
        let text = format!(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>",
            values.vtk_type(),
            escape(name),
            values.components(),
            self.offset
        );
        self.xml(&text);
        self.offset += 8 + values.bytes();
        self.arrays.push(values);
    }

    /// Writes everything.
    pub(super) fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(self.xml.as_bytes())?;
        write!(out, "</{}>\n<AppendedData encoding=\"raw\">\n_", self.kind)?;
        for array in &self.arrays {
            out.write_all(&array.bytes().to_le_bytes())?;
            array.write(out)?;
        }
        out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }
}
