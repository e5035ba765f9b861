//! Vertices of PLY files (Turk 1994), text or binary.

use meltpath_geometry::math::DVec3;

use super::wrong::Wrong;

/// A format of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Format {
    Text,
    Little,
    Big,
}

/// A number of a property, by its width.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Number::I8,
            "uchar" | "uint8" => Number::U8,
            "short" | "int16" => Number::I16,
            "ushort" | "uint16" => Number::U16,
            "int" | "int32" => Number::I32,
            "uint" | "uint32" => Number::U32,
            "float" | "float32" => Number::F32,
            "double" | "float64" => Number::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::F64 => 8,
        }
    }

    /// The number that begins these bytes, lowest first.
    fn value(self, b: [u8; 8]) -> f64 {
        let [a, b2, c, d, ..] = b;
        match self {
            Number::I8 => f64::from(i8::from_le_bytes([a])),
            Number::U8 => f64::from(a),
            Number::I16 => f64::from(i16::from_le_bytes([a, b2])),
            Number::U16 => f64::from(u16::from_le_bytes([a, b2])),
            Number::I32 => f64::from(i32::from_le_bytes([a, b2, c, d])),
            Number::U32 => f64::from(u32::from_le_bytes([a, b2, c, d])),
            Number::F32 => f64::from(f32::from_le_bytes([a, b2, c, d])),
            Number::F64 => f64::from_le_bytes(b),
        }
    }
}

/// What a header says of the vertices.
struct Header {
    format: Format,
    vertices: usize,
    properties: Vec<(String, Number)>,
    /// Where numbers begin.
    body: usize,
}

fn wrong<T>(place: impl Into<String>, message: impl Into<String>) -> Result<T, Wrong> {
    Err(Wrong {
        place: place.into(),
        message: message.into(),
    })
}

fn header(bytes: &[u8]) -> Result<Header, Wrong> {
    let (mut format, mut vertices, mut properties) = (None, None, Vec::new());
    let (mut at, mut number, mut inside) = (0, 0, false);
    loop {
        let Some(end) = bytes[at..].iter().position(|b| *b == b'\n') else {
            return wrong("header", "it does not end: the file is cut, or no PLY");
        };
        let line = String::from_utf8_lossy(&bytes[at..at + end]);
        let line = line.trim();
        at += end + 1;
        number += 1;
        let place = || format!("line {number}");
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            _ if number == 1 && line != "ply" => {
                return wrong(place(), "it does not begin with ply");
            }
            ["format", word, ..] => {
                format = Some(match word {
                    "ascii" => Format::Text,
                    "binary_little_endian" => Format::Little,
                    "binary_big_endian" => Format::Big,
                    _ => return wrong(place(), format!("no format {word} is known")),
                });
            }
            ["element", "vertex", count] => {
                let Ok(count) = count.parse::<usize>() else {
                    return wrong(place(), format!("{count} is no number of vertices"));
                };
                (vertices, inside) = (Some(count), true);
            }
            ["element", name, ..] => {
                if vertices.is_none() {
                    let message = format!("{name} stands before the vertices: write these first");
                    return wrong(place(), message);
                }
                inside = false;
            }
            ["property", "list", ..] if inside => {
                return wrong(
                    place(),
                    "vertices with a list: write them with numbers alone",
                );
            }
            ["property", word, name] if inside => {
                let Some(kind) = Number::of(word) else {
                    return wrong(place(), format!("no kind of number {word} is known"));
                };
                properties.push((name.to_owned(), kind));
            }
            ["end_header"] => break,
            _ => {}
        }
    }
    match (format, vertices) {
        (Some(format), Some(vertices)) => Ok(Header {
            format,
            vertices,
            properties,
            body: at,
        }),
        (None, _) => wrong("header", "it tells no format"),
        (_, None) => wrong("header", "it tells no vertices"),
    }
}

/// The vertices of a PLY file.
pub(super) fn points(bytes: &[u8]) -> Result<Vec<DVec3>, Wrong> {
    let header = header(bytes)?;
    let mut columns = [0; 3];
    for (column, name) in columns.iter_mut().zip(["x", "y", "z"]) {
        let Some(found) = header.properties.iter().position(|p| p.0 == name) else {
            return wrong("header", format!("its vertices have no {name}"));
        };
        *column = found;
    }
    let body = &bytes[header.body..];
    match header.format {
        Format::Text => text(&String::from_utf8_lossy(body), &header, columns),
        format => binary(body, &header, columns, format == Format::Big),
    }
}

fn text(body: &str, header: &Header, columns: [usize; 3]) -> Result<Vec<DVec3>, Wrong> {
    let mut points = Vec::new();
    let rows = body.lines().map(str::trim).filter(|l| !l.is_empty());
    for row in rows.take(header.vertices) {
        let cells: Vec<&str> = row.split_whitespace().collect();
        let value = |column: usize| cells.get(column).and_then(|c| c.parse::<f64>().ok());
        let [Some(x), Some(y), Some(z)] = columns.map(value) else {
            let place = format!("vertex {}", points.len() + 1);
            return wrong(place, "no x, y, z there");
        };
        points.push(DVec3::new(x, y, z));
    }
    whole(points, header)
}

fn binary(
    body: &[u8],
    header: &Header,
    columns: [usize; 3],
    big: bool,
) -> Result<Vec<DVec3>, Wrong> {
    let width: usize = header.properties.iter().map(|p| p.1.bytes()).sum();
    let start = |column: usize| -> usize {
        header.properties[..column]
            .iter()
            .map(|p| p.1.bytes())
            .sum()
    };
    let columns = columns.map(|c| (start(c), header.properties[c].1));
    let vertex = |row: &[u8]| {
        let [x, y, z] = columns.map(|(at, kind)| {
            let own = &row[at..at + kind.bytes()];
            let mut value = [0; 8];
            value[..own.len()].copy_from_slice(own);
            if big {
                value[..own.len()].reverse();
            }
            kind.value(value)
        });
        DVec3::new(x, y, z)
    };
    let rows = body.chunks_exact(width).take(header.vertices);
    whole(rows.map(vertex).collect(), header)
}

fn whole(points: Vec<DVec3>, header: &Header) -> Result<Vec<DVec3>, Wrong> {
    if points.len() == header.vertices {
        return Ok(points);
    }
    let message = format!(
        "{} vertices are told and {} are there: the file is cut",
        header.vertices,
        points.len()
    );
    wrong("its end", message)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "element vertex 2\nproperty uchar red\nproperty float x\nproperty double y\nproperty short z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

    #[test]
    fn the_same_vertices_in_all_formats() {
        let wanted = vec![DVec3::new(1.5, -2.25, 3.0), DVec3::new(0.5, 1e3, -4.0)];
        let ascii = format!(
            "ply\nformat ascii 1.0\ncomment a scan\n{HEAD}9 1.5 -2.25 3\n7 0.5 1e3 -4\n3 0 1 1\n"
        );
        assert_eq!(points(ascii.as_bytes()).unwrap(), wanted);
        for big in [false, true] {
            let name = if big { "big" } else { "little" };
            let mut bytes = format!("ply\nformat binary_{name}_endian 1.0\n{HEAD}").into_bytes();
            let turned = |mut b: Vec<u8>| {
                if big {
                    b.reverse();
                }
                b
            };
            for p in &wanted {
                bytes.push(7);
                bytes.extend(turned((p.x as f32).to_le_bytes().to_vec()));
                bytes.extend(turned(p.y.to_le_bytes().to_vec()));
                bytes.extend(turned((p.z as i16).to_le_bytes().to_vec()));
            }
            bytes.extend([3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1]);
            assert_eq!(points(&bytes).unwrap(), wanted);
            let cut = points(&bytes[..bytes.len() - 20]).unwrap_err().message;
            assert!(cut.contains("2 vertices are told and 1 are there"), "{cut}");
        }
    }

    #[test]
    fn what_is_wrong_with_a_header_is_told() {
        for (text, told) in [
            ("plx\n", "does not begin"),
            ("ply\nformat ascii 1.0\n", "does not end"),
            ("ply\nend_header\n", "no format"),
            ("ply\nformat ascii 1.0\nend_header\n", "no vertices"),
            (
                "ply\nformat ascii 1.0\nelement face 1\n",
                "before the vertices",
            ),
            (
                "ply\nformat ascii 1.0\nelement vertex -1\n",
                "no number of vertices",
            ),
            (
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
                "no z",
            ),
        ] {
            let message = points(text.as_bytes()).unwrap_err().message;
            assert!(message.contains(told), "{message}");
        }
    }
}
