//! STL, binary and ASCII, in and out. The format has no specification beyond 3D Systems' 1989 layout: 80 bytes
//! of header, a triangle count, then 50 bytes a triangle (normal, three corners in 32-bit floats, two spare bytes).

use std::io::{self, BufRead, Read, Write};

use meltpath_base::{Cancelled, Observer, Place, Reporter};
use thiserror::Error;

use crate::{Mesh, math::DVec3, weld::VertexIndex};

/// Bytes before the first triangle of a binary file.
const HEADER: u64 = 84;
/// Bytes of one triangle in a binary file.
const RECORD: usize = 50;
/// Records read at a time.
const BATCH: usize = 4096;
/// Bytes looked at to tell text from binary.
const HEAD: usize = 4096;
/// Longest word accepted in a text file, bytes.
const LONGEST_WORD: usize = 256;

/// Why an STL file could not be read.
#[derive(Debug, Error)]
pub enum StlError {
    /// Reading failed.
    #[error("cannot read the STL data: {0}")]
    Io(#[from] io::Error),
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// No bytes at all.
    #[error("the STL file is empty (0 bytes): export the part again")]
    Empty,
    /// A file without triangles.
    #[error("the STL file has a header but no triangle: export the part again")]
    NoTriangles,
    /// Neither a binary nor a text STL.
    #[error("this is not an STL file: it starts with neither `solid` nor an 84-byte binary header")]
    NotStl,
    /// The binary file ends too early.
    #[error(
        "the binary STL is cut short: it announces {announced} triangles but ends at byte {end}, \
         inside triangle {triangle} (counted from 1): copy or export the file again"
    )]
    Truncated {
        /// Triangles that the header announces.
        announced: u32,
        /// First triangle that is not whole, counted from 1.
        triangle: u64,
        /// Bytes in the file.
        end: u64,
    },
    /// The binary file goes on after the triangles that it announces: its count was cut, or the file was written twice.
    #[error(
        "the binary STL announces {announced} triangles, and {more} more follow: its count is wrong, export the file again"
    )]
    Count {
        /// Triangles that the header announces.
        announced: u32,
        /// Whole triangles that follow.
        more: u64,
    },
    /// A corner is not a finite number.
    #[error(
        "triangle {triangle} (counted from 1) has a corner that is not a finite number, at byte {offset}"
    )]
    NotFinite {
        /// Triangle, counted from 1.
        triangle: u64,
        /// Byte offset of the coordinate in the file.
        offset: u64,
    },
    /// The text does not follow the grammar.
    #[error("line {line}: expected {expected}, found `{found}`")]
    Text {
        /// Line, counted from 1.
        line: u64,
        /// What the grammar wants here.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// The text ends inside a facet.
    #[error("the text STL is cut short: line {line} ends the file where {expected} should stand")]
    TextTruncated {
        /// Last line, counted from 1.
        line: u64,
        /// What the grammar wants here.
        expected: &'static str,
    },
    /// More vertices than indices can count.
    #[error("more than four thousand million distinct vertices: split or decimate the part")]
    TooLarge,
}

/// What an STL file held.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stl {
    /// The name after `solid`, or the binary header's text; may be empty.
    pub name: String,
    /// The triangles with welded vertices, in the file's unit.
    pub mesh: Mesh,
}

/// Reads an STL, telling binary from text by its content.
///
/// The file is text when it starts with `solid` (or `facet`) and its first 4 KiB hold no control byte: a
/// binary file whose header starts with `solid` has zero bytes in its header, count or floats. Vertices with
/// identical coordinates are welded; nothing else is changed. `length` is the number of bytes to come where
/// known: it sizes memory and serves the checks; nothing is allocated on the file's own announcement.
/// Several `solid`s in one text file become one mesh.
///
/// Warns (`stl-trailing-bytes`, `stl-count`, `stl-unterminated`, `stl-several-solids`) and goes on where the
/// triangles are whole but something around them is not.
///
/// # Errors
/// Empty, truncated or foreign data, coordinates that are not finite: see [`StlError`].
pub fn read_stl(
    mut reader: impl BufRead,
    length: Option<u64>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Stl, StlError> {
    let mut head = Vec::with_capacity(HEAD);
    reader.by_ref().take(HEAD as u64).read_to_end(&mut head)?;
    if head.is_empty() {
        return Err(StlError::Empty);
    }
    if is_text(&head) {
        let expected = length.unwrap_or(0) / 250;
        let mut words = Words::new((&head[..]).chain(reader));
        return read_text(&mut words, expected, reporter, observer);
    }
    if !has_control_bytes(&head) {
        return Err(StlError::NotStl);
    }
    read_binary(&mut (&head[..]).chain(reader), length, reporter, observer)
}

/// Text starts with `solid` or `facet` after blanks and a byte-order mark, and holds no control byte.
fn is_text(head: &[u8]) -> bool {
    let body = head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head);
    let body = body.trim_ascii_start();
    let starts = |word: &[u8]| {
        body.get(..word.len())
            .is_some_and(|b| b.eq_ignore_ascii_case(word))
    };
    (starts(b"solid") || starts(b"facet")) && !has_control_bytes(head)
}

/// Whether bytes occur that no text holds.
fn has_control_bytes(head: &[u8]) -> bool {
    head.iter()
        .any(|&b| b < 0x20 && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0B | 0x0C))
}

/// Fills `buffer` as far as the data goes; the number of bytes read.
fn read_full(reader: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match reader.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}

/// The little-endian float at `at`; `record` is long enough by construction.
fn float(record: &[u8], at: usize) -> f32 {
    let mut bytes = [0; 4];
    bytes.copy_from_slice(&record[at..at + 4]);
    f32::from_le_bytes(bytes)
}

/// The corners of a binary record; `triangle` counts from 0.
fn corners_of(record: &[u8], triangle: u64, index: &mut VertexIndex) -> Result<[u32; 3], StlError> {
    let mut corners = [0; 3];
    for (c, corner) in corners.iter_mut().enumerate() {
        let at = 12 + 12 * c;
        let xyz = [
            float(record, at),
            float(record, at + 4),
            float(record, at + 8),
        ];
        if let Some(bad) = xyz.iter().position(|x| !x.is_finite()) {
            return Err(StlError::NotFinite {
                triangle: triangle + 1,
                offset: HEADER + triangle * RECORD as u64 + (at + 4 * bad) as u64,
            });
        }
        let p = DVec3::new(xyz[0].into(), xyz[1].into(), xyz[2].into());
        *corner = index.index(p).ok_or(StlError::TooLarge)?;
    }
    Ok(corners)
}

fn read_binary(
    reader: &mut impl Read,
    length: Option<u64>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Stl, StlError> {
    let mut header = [0; HEADER as usize];
    let got = read_full(reader, &mut header)?;
    if got < header.len() {
        return Err(StlError::Truncated {
            announced: 0,
            triangle: 1,
            end: got as u64,
        });
    }
    let mut count = [0; 4];
    count.copy_from_slice(&header[80..]);
    let announced = u32::from_le_bytes(count);
    // writers that stream leave 0 or all ones in the count: then the data itself counts
    let uncounted = announced == 0 || announced == u32::MAX;
    let limit = if uncounted {
        u64::MAX
    } else {
        announced.into()
    };
    let expected = length
        .map_or(0, |bytes| bytes.saturating_sub(HEADER) / RECORD as u64)
        .min(limit);
    observer.stage("read part", expected);

    let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(expected as usize);
    let mut index = VertexIndex::with_capacity(expected as usize / 2);
    let mut buffer = vec![0; RECORD * BATCH];
    let mut done: u64 = 0;
    let mut spare = 0;
    while done < limit {
        observer.check()?;
        let wanted = (limit - done).min(BATCH as u64) as usize * RECORD;
        let got = read_full(reader, &mut buffer[..wanted])?;
        for (k, record) in buffer[..got].chunks_exact(RECORD).enumerate() {
            let triangle = done + k as u64;
            let corners = corners_of(record, triangle, &mut index)?;
            triangles.push(corners);
        }
        let whole = got / RECORD;
        done += whole as u64;
        observer.advance(whole as u64);
        if got < wanted {
            spare = got % RECORD;
            break;
        }
    }
    if spare > 0 || (done < limit && !uncounted) {
        return Err(StlError::Truncated {
            announced,
            triangle: done + 1,
            end: HEADER + done * RECORD as u64 + spare as u64,
        });
    }
    if done == 0 {
        return Err(StlError::NoTriangles);
    }
    if uncounted {
        reporter.warn(
            "stl-count",
            format!(
                "the binary STL announces {announced} triangles but holds {done}: all were read"
            ),
            "",
        );
    }
    let trailing = io::copy(reader, &mut io::sink())?;
    // whole triangles, not somebody's notes
    if trailing > 0 && trailing.is_multiple_of(RECORD as u64) {
        return Err(StlError::Count {
            announced,
            more: trailing / RECORD as u64,
        });
    }
    if trailing > 0 {
        reporter.warn(
            "stl-trailing-bytes",
            format!(
                "{trailing} bytes follow the last triangle, from byte {}: they were ignored",
                HEADER + done * RECORD as u64
            ),
            "export the part again if triangles are missing",
        );
    }
    let text: Vec<u8> = header[..80]
        .iter()
        .copied()
        .take_while(|&b| b != 0)
        .collect();
    let text = String::from_utf8_lossy(&text);
    let name = text.trim().trim_start_matches("solid").trim().to_owned();
    triangles.shrink_to_fit();
    Ok(Stl {
        name,
        mesh: Mesh {
            vertices: index.into_vertices(),
            triangles,
        },
    })
}

/// Splits text into words, counting lines.
struct Words<R> {
    reader: R,
    line: u64,
    word: Vec<u8>,
}

impl<R: BufRead> Words<R> {
    fn new(reader: R) -> Self {
        Words {
            reader,
            line: 1,
            word: Vec::new(),
        }
    }

    /// Reads the next word into `self.word`; `false` at the end. An overlong word is cut (and fits nothing).
    fn next(&mut self) -> io::Result<bool> {
        self.word.clear();
        loop {
            let available = self.reader.fill_buf()?;
            if available.is_empty() {
                return Ok(!self.word.is_empty());
            }
            let mut used = 0;
            let mut complete = false;
            for &b in available {
                if b.is_ascii_whitespace() || b == 0x0B {
                    if !self.word.is_empty() {
                        complete = true;
                        break;
                    }
                    self.line += u64::from(b == b'\n');
                } else if self.word.len() < LONGEST_WORD {
                    self.word.push(b);
                }
                used += 1;
            }
            self.reader.consume(used);
            if complete {
                return Ok(true);
            }
        }
    }

    /// The rest of the line, at most [`LONGEST_WORD`] bytes of it.
    fn rest_of_line(&mut self) -> io::Result<String> {
        let mut rest = Vec::new();
        loop {
            let available = self.reader.fill_buf()?;
            let end = available.iter().position(|&b| b == b'\n' || b == b'\r');
            let part = &available[..end.unwrap_or(available.len())];
            let room = LONGEST_WORD - rest.len();
            rest.extend_from_slice(&part[..part.len().min(room)]);
            let (used, finished) = (part.len(), end.is_some() || available.is_empty());
            self.reader.consume(used);
            if finished {
                return Ok(String::from_utf8_lossy(&rest).trim().to_owned());
            }
        }
    }

    fn is(&self, keyword: &str) -> bool {
        self.word.eq_ignore_ascii_case(keyword.as_bytes())
    }

    fn unexpected(&self, expected: &'static str) -> StlError {
        StlError::Text {
            line: self.line,
            expected,
            found: String::from_utf8_lossy(&self.word).into_owned(),
        }
    }

    /// The next word must be `keyword`.
    fn expect(&mut self, keyword: &'static str) -> Result<(), StlError> {
        if !self.next()? {
            return Err(StlError::TextTruncated {
                line: self.line,
                expected: keyword,
            });
        }
        if self.is(keyword) {
            Ok(())
        } else {
            Err(self.unexpected(keyword))
        }
    }

    /// The next word must be a number (finite or not).
    fn number(&mut self) -> Result<f64, StlError> {
        const EXPECTED: &str = "a number (with a point, not a comma)";
        if !self.next()? {
            return Err(StlError::TextTruncated {
                line: self.line,
                expected: EXPECTED,
            });
        }
        std::str::from_utf8(&self.word)
            .ok()
            .and_then(|w| w.parse().ok())
            .ok_or_else(|| self.unexpected(EXPECTED))
    }
}

fn read_text<R: BufRead>(
    words: &mut Words<R>,
    expected: u64,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Stl, StlError> {
    observer.stage("read part", expected);
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut index = VertexIndex::default();
    let mut name = None;
    let mut solids = 0_u64;
    let mut open = false;
    while words.next()? {
        if words.word.starts_with(b"\xEF\xBB\xBF") {
            words.word.drain(..3);
        }
        if words.is("facet") {
            // normals are recomputed from the corners: three numbers, whatever they say
            words.expect("normal")?;
            for _ in 0..3 {
                words.number()?;
            }
            words.expect("outer")?;
            words.expect("loop")?;
            let mut corners = [0; 3];
            for corner in &mut corners {
                words.expect("vertex")?;
                let p = DVec3::new(words.number()?, words.number()?, words.number()?);
                if !p.is_finite() {
                    return Err(words.unexpected("finite coordinates"));
                }
                *corner = index.index(p).ok_or(StlError::TooLarge)?;
            }
            words.expect("endloop")?;
            words.expect("endfacet")?;
            triangles.push(corners);
            if triangles.len().is_multiple_of(BATCH) {
                observer.check()?;
                observer.advance(BATCH as u64);
            }
        } else if words.is("solid") {
            let rest = words.rest_of_line()?;
            name.get_or_insert(rest);
            solids += 1;
            open = true;
        } else if words.is("endsolid") {
            words.rest_of_line()?;
            open = false;
        } else {
            return Err(words.unexpected("`facet`, `solid` or `endsolid`"));
        }
    }
    if triangles.is_empty() {
        return Err(StlError::NoTriangles);
    }
    if open {
        reporter.warn_at(
            "stl-unterminated",
            format!(
                "the text STL ends without `endsolid` after {} whole triangles",
                triangles.len()
            ),
            Place {
                line: u32::try_from(words.line).ok(),
                ..Place::default()
            },
            "export the part again if triangles are missing",
        );
    }
    if solids > 1 {
        reporter.warn(
            "stl-several-solids",
            format!("the text STL holds {solids} solids: they were read as one part"),
            "",
        );
    }
    Ok(Stl {
        name: name.unwrap_or_default(),
        mesh: Mesh {
            vertices: index.into_vertices(),
            triangles,
        },
    })
}

/// Unit normal of a triangle for the file; zero for a degenerate one.
fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// Writes a binary STL. Coordinates are rounded to 32-bit floats; the header is `name`, cut to 80 bytes and
/// never starting with `solid`, so that no reader takes it for text.
///
/// # Errors
/// Writing failed, or the mesh has more triangles than the format can count.
pub fn write_stl(mesh: &Mesh, name: &str, writer: &mut impl Write) -> io::Result<()> {
    let count = u32::try_from(mesh.triangles.len()).map_err(|_| {
        io::Error::new(
            io::ErrorKind::InvalidInput,
            "too many triangles for an STL file",
        )
    })?;
    let mut header = [b' '; 80];
    let text = format!("meltpath {name}");
    let length = text.len().min(header.len());
    header[..length].copy_from_slice(&text.as_bytes()[..length]);
    writer.write_all(&header)?;
    writer.write_all(&count.to_le_bytes())?;
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t);
        let mut record = [0; RECORD];
        let points = std::iter::once(normal(corners)).chain(corners);
        for (k, x) in points.flat_map(|p| p.to_array()).enumerate() {
            record[4 * k..4 * k + 4].copy_from_slice(&(x as f32).to_le_bytes());
        }
        writer.write_all(&record)?;
    }
    Ok(())
}
